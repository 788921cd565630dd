"""What is kept of a sheet between two equilibria."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np


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
    """

    points: np.ndarray
    plastic: np.ndarray
    stretch: np.ndarray
    slip: tuple[np.ndarray, ...] = ()
