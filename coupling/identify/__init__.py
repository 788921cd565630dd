"""Identification: stiffness, tilts and backlash of a robot from measured static deflections.

Compliances by linear least squares on the exact Jacobian, then the model's own equilibria; what the
data do not tell is not told.  docs/identify.md has the equations.
"""
