"""sheet-fem: a quasi-static elastoplastic sheet under moving hemispherical tools.

The path from the case to the force: table -> process -> schedule (where) -> forming (one equilibrium
after the other) -> equilibrium (Newton's method) -> assembly -> element, contact, friction, band ->
section -> material.  Theory and verification: docs/sheet_fem.md.
"""

from coupling.process.sheet.table import SheetFemTable

__all__ = ["SheetFemTable"]
