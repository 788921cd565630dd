"""sheet-fem: a quasi-static elastoplastic sheet under a moving hemispherical tool.

The path from the case to the force: table -> process -> schedule (where) -> forming (one equilibrium
after the other) -> equilibrium (Newton's method) -> assembly -> element, contact -> section ->
material.  Theory and verification: docs/sheet_fem.md.
"""

from coupling.process.sheet.table import SheetFemTable

__all__ = ["SheetFemTable"]
