"""How the force on a tool answers to the tool's displacement: the sheet's stiffness as it feels it."""

from __future__ import annotations

import numpy as np

from coupling.sheet_fem.assembly import Assembler
from coupling.sheet_fem.equilibrium import Equilibrium


def tool_stiffness(assemble: Assembler, found: Equilibrium) -> np.ndarray:
    """Return K = -dF/dc of every sphere [N/m], (spheres, 3, 3), symmetric and not negative.

    F is the force on a sphere with its centre at c, the other spheres at rest and the history before
    the move given.  The contact depends on the sheet's place relative to the sphere, so that with the
    residual r(p, c) of the control points p

        dF/dc = -T + C dp/dc,  S dp/dc = -dr/dc = B,  K = T - C S^-1 B.

    T is the contact's tangent summed, C = dF/dp, and S = dr/dp the sheet's stiffness at the equilibrium.
    Friction makes K unsymmetric, and a sheet that gives way under the tool negative: of K is returned
    the symmetric part without what is negative of it.
    """
    stiffness = np.zeros((len(found.spheres), 3, 3))
    grips = {
        k: grip
        for k, sphere in enumerate(found.spheres)
        if np.any(found.forces[k])
        and (grip := assemble.grip(found.box, sphere, found.before, found.state, k))
    }
    if not grips:
        return stiffness
    follows = found.tangent.solve(np.hstack([grip.on_sheet for grip in grips.values()]))
    for column, (k, grip) in enumerate(grips.items()):
        stiffness[k] = grip.own - grip.by_sheet.T @ follows[:, 3 * column : 3 * column + 3]
    return _not_negative(stiffness)


def _not_negative(matrices: np.ndarray) -> np.ndarray:
    """Return the symmetric matrices nearest to given ones that are not negative, (n, 3, 3)."""
    values, vectors = np.linalg.eigh(0.5 * (matrices + matrices.swapaxes(1, 2)))
    kept: np.ndarray = (vectors * np.maximum(values, 0.0)[:, None]) @ vectors.swapaxes(1, 2)
    return kept
