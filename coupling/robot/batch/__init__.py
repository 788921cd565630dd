"""Kinematics and dynamics of one rigid robot for thousands of states at once."""
