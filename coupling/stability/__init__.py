"""Regenerative stability of milling: a linear structure, and a cut that is a periodic delay."""
