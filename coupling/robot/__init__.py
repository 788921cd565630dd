"""Robots at the desk: inverse kinematics and simulation of a cell."""
