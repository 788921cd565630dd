"""FANUC TP: written and read."""
