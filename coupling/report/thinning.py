"""Fewer points of long curves, without losing a peak."""

from __future__ import annotations

import numpy as np

# Parts of the time axis: about two for each of a figure's pixels.
PARTS = 1500


def extremes(time: np.ndarray, values: np.ndarray, parts: int = PARTS) -> np.ndarray:
    """Return the rows of the smallest and the largest value in each part of the time, and the ends.

    Args:
        time: Rising times [s], (n,).
        values: Values of the curve, any unit, (n,).
        parts: Number of equal parts of the time; up to twice as many values are kept whole.

    Example:
        >>> extremes(np.arange(9.0), np.array([0.0, 0, 5, 0, 0, 0, 0, -1, 0]), parts=2)
        array([0, 2, 4, 7, 8])
    """
    count = len(time)
    if count <= 2 * parts:
        return np.arange(count)
    edges = np.searchsorted(time, np.linspace(time[0], time[-1], parts + 1)[1:-1])
    rows = {0, count - 1}
    for part in np.split(np.arange(count), edges):
        if len(part):
            rows |= {int(part[values[part].argmin()]), int(part[values[part].argmax()])}
    return np.array(sorted(rows))
