"""Modes and compliance of a robot where it works: eigenfrequencies, shapes, frequency responses."""
