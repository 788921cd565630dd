"""Coulomb friction with an elastic slip: what slides holds, up to a small length."""

from __future__ import annotations

import numpy as np

from coupling.sheet_fem.compiled import compiled


@compiled
def elastic_slip(
    drift: np.ndarray,
    normal: np.ndarray,
    distance: float,
    length: float,
    slip: np.ndarray,
    tangent: np.ndarray,
) -> None:
    """Return mapping of the slip at a contact point [SimoLaursen1992].

    The traction on the tool is mu p s / length, s the elastic slip: what a point of the sheet has
    moved along the tool, cut to `length`.  So the traction never exceeds mu p, whatever the pressure
    does, and what is cut off does work against it only.

    Args:
        drift: Elastic slip before and what the sheet has moved relative to the tool since [m], (3,).
        normal: Unit vector from the point to the sphere's centre, (3,).
        distance: Distance between both [m].
        length: Largest elastic slip [m].
        slip: Written: elastic slip after [m], (3,).
        tangent: Written: its derivative by the place of the point [1], (3, 3).
    """
    along = drift[0] * normal[0] + drift[1] * normal[1] + drift[2] * normal[2]
    for k in range(3):
        slip[k] = drift[k] - along * normal[k]
    turn = 1.0 + along / distance
    for k in range(3):
        for m in range(3):
            # The normal turns as the point moves: P drift with P = 1 - n n.
            tangent[k, m] = normal[k] * (slip[m] / distance - turn * normal[m])
        tangent[k, k] += turn
    size = np.sqrt(slip[0] * slip[0] + slip[1] * slip[1] + slip[2] * slip[2])
    if size <= length:
        return
    scale = length / size
    for m in range(3):
        along = (slip[0] * tangent[0, m] + slip[1] * tangent[1, m] + slip[2] * tangent[2, m]) / size
        for k in range(3):
            tangent[k, m] = scale * (tangent[k, m] - slip[k] / size * along)
    for k in range(3):
        slip[k] *= scale
