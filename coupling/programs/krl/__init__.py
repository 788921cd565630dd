"""KUKA KRL: written and read."""
