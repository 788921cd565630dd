"""Forces of teeth in steady feed."""

import numpy as np

from coupling.process.cutting_force import (
    Cutter,
    CuttingCoefficients,
    Engagement,
    Way,
    tooth_wrench,
)


def steady_wrench(
    cutter: Cutter, coefficients: CuttingCoefficients, cut: Engagement, time: np.ndarray
) -> np.ndarray:
    """Return the wrench of teeth [N, N m], (n, 6), with the chip of the first instant of `cut`."""
    ends = np.array([-10.0, 10.0])
    way = Way(ends, np.outer(ends / cutter.tooth_period, cut.chip[0]))
    feed = np.tile([1.0, 0.0], (len(time), 1))
    return tooth_wrench(cutter, coefficients, cut, way, feed, time)


ALUMINIUM = CuttingCoefficients(7.7e8, 1.7e8, 2.2e8, 2.8e4, 2.7e4, 700.0)
RADIUS, SPEED = 8e-3, 2000.0
