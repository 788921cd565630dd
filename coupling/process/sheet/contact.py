"""Contact with a sphere by a smoothed penalty."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from coupling.process.sheet.compiled import compiled


class Sphere(NamedTuple):
    """The tool's hemispherical end.

    Attributes:
        center: In the part frame [m], (3,).
        radius: [m].
        stiffness: Pressure per penetration [Pa/m].
        smoothing: Penetration over which the stiffness rises linearly from zero [m].
        friction: Coefficient mu of Coulomb's law.
        slip_length: Elastic slip at which the sheet slides [m].
        moved: Since the last equilibrium, without turning [m], (3,).
    """

    center: np.ndarray
    radius: float
    stiffness: float
    smoothing: float
    friction: float
    slip_length: float
    moved: np.ndarray


@compiled
def pressure(penetration: float, stiffness: float, smoothing: float) -> tuple[float, float]:
    """Return pressure [Pa] and its slope [Pa/m]; continuous with its slope, zero without contact.

    Example:
        >>> pressure(2e-6, 1e12, 1e-6)
        (1500000.0, 1000000000000.0)
    """
    if penetration <= 0.0:
        return 0.0, 0.0
    if penetration < smoothing:
        return 0.5 * stiffness * penetration**2 / smoothing, stiffness * penetration / smoothing
    return stiffness * (penetration - 0.5 * smoothing), stiffness
