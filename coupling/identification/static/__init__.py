"""Stiffness, tilts and backlash of a robot from measured static deflections.

Compliances by linear least squares on the exact Jacobian, then the model's own equilibria; what the
data do not identify keeps its start value.  docs/identify.md has the equations.
"""
