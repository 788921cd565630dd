"""Compiled C: the core in libraries, of FMUs and of the desk, and the robot as their text."""
