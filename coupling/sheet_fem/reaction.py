"""Derivative of the force on a tool by the tool's displacement: the sheet's stiffness as it feels it."""

from __future__ import annotations

import numpy as np

from coupling.sheet_fem.assembly import Assembler
from coupling.sheet_fem.equilibrium import Equilibrium


def tool_stiffness(assemble: Assembler, found: Equilibrium) -> np.ndarray:
    """Return K = -dF/dc of all spheres [N/m], (3 spheres, 3 spheres), one after the other.

    F are the forces on the spheres with their centres at c, the history before the move given.  A
    contact depends on the sheet's place relative to the sphere, so that with the
    residual r(p, c) of the control points p

        dF/dc = -T + C dp/dc,  S dp/dc = -dr/dc = B,  K = T - C S^-1 B.

    T are the contacts' tangents summed, C = dF/dp, and S = dr/dp the sheet's stiffness at the
    equilibrium.  Friction makes K unsymmetric, and a sheet that gives way under the tool negative: of
    what a sphere feels of its own move is returned the symmetric part without what is negative of it.
    """
    count = len(found.spheres)
    stiffness = np.zeros((count, 3, count, 3))
    grips = {
        k: grip
        for k, sphere in enumerate(found.spheres)
        if np.any(found.forces[k])
        and (grip := assemble.grip(found.box, sphere, found.before, found.state, k))
    }
    if not grips:
        return stiffness.reshape(3 * count, 3 * count)
    pushed = np.hstack([grip.on_sheet for grip in grips.values()])
    at_interface = np.zeros((found.tangent.size - len(pushed), pushed.shape[1]))
    follows = found.tangent.solve(np.vstack([pushed, at_interface]))[: len(pushed)]
    for column, j in enumerate(grips):
        for i, grip in grips.items():
            stiffness[i, :, j] = -grip.by_sheet.T @ follows[:, 3 * column : 3 * column + 3]
        stiffness[j, :, j] = _not_negative(grips[j].own + stiffness[j, :, j])
    return stiffness.reshape(3 * count, 3 * count)


def _not_negative(matrix: np.ndarray) -> np.ndarray:
    """Return the symmetric matrix nearest to a given one that is not negative, (3, 3)."""
    values, vectors = np.linalg.eigh(0.5 * (matrix + matrix.T))
    kept: np.ndarray = (vectors * np.maximum(values, 0.0)) @ vectors.T
    return kept
