"""A quasi-static elastoplastic sheet under moving hemispherical tools.

The path to the force: schedule (where) -> forming (one equilibrium after the other) -> equilibrium
(Newton's method) -> assembly -> element, edge_elements, macro_elements, far_field, contact, banded ->
shell -> section -> return_mapping, eigenbasis.  The grid, and what a finer one would give: mesh.
Theory and verification: docs/sheet_fem.md; the process that it serves: `coupling.process.sheet_fem`.
"""
