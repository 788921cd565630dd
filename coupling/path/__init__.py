"""Paths and wrenches over time, and what is measured on them."""
