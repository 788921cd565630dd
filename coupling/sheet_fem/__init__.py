"""A quasi-static elastoplastic sheet under moving hemispherical tools.

The path to the force: schedule (where) -> forming (one equilibrium after the other) -> equilibrium
(Newton's method) -> assembly -> element, cells, contact, banded -> shell -> section ->
eigenbasis, material.  What smaller elements would give: fineness.  Theory and verification:
docs/sheet_fem.md; the process that it serves: `coupling.process.sheet_fem`.
"""
