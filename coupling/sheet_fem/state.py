"""What is kept of a sheet between two equilibria."""

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
        plastic: Plastic strain 11, 22, 2*12 and equivalent plastic strain of every layer at every
            integration point, (nx, ny, points, layers, 4).
        stretch: Thickness over first thickness, (nx, ny, points).
        slip: Elastic slip of each tool with friction at the contact points [m],
            (nx, ny, contact points, 3), zero out of contact; empty for one without friction.
        around: What the sheet does outside of the box that was solved last; None if it was all of it.
        at_rim: Coarse unknowns at the rim of that box, from where that was made linear [m], (m,).
        travel: How it came here; None for one that has not been formed.
    """

    points: np.ndarray
    plastic: np.ndarray
    stretch: np.ndarray
    slip: tuple[np.ndarray, ...] = ()
    around: CondensedFarField | None = None
    at_rim: np.ndarray = field(default_factory=lambda: np.zeros(0))
    travel: Increment | None = None
