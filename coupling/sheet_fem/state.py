"""State of a sheet between two equilibria."""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np

from coupling.sheet_fem.far_field import CondensedFarField
from coupling.sheet_fem.travel import Increment


@dataclass(frozen=True)
class SheetState:
    """Shape and history of the sheet.

    Attributes:
        points: Control points of the midsurface in the part frame [m], (nx + 2, ny + 2, 3).
        plastic: Plastic strain 11, 22, 2*12 and equivalent plastic strain [1] of every layer at every
            integration point, (nx, ny, points, layers, 4).
        stretch: Thickness over first thickness [1], (nx, ny, points).
        slip: Elastic slip of each tool with friction at the contact points [m],
            (nx, ny, contact points, 3), zero out of contact; empty for one without friction.
        far_field: The sheet outside of the box that was solved last; None if that was all of it.
        at_interface: Coarse unknowns at its interface since it was linearised [m], (m,).
        travel: The last increment; None for a sheet that has not been formed.
    """

    points: np.ndarray
    plastic: np.ndarray
    stretch: np.ndarray
    slip: tuple[np.ndarray, ...] = ()
    far_field: CondensedFarField | None = None
    at_interface: np.ndarray = field(default_factory=lambda: np.zeros(0))
    travel: Increment | None = None
