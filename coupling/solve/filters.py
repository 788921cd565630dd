"""Limit of a correction's rate."""

from __future__ import annotations

import numpy as np


def limit_rate(time: np.ndarray, correction: np.ndarray, max_rate: float) -> np.ndarray:
    """Return a correction of which no component changes faster than `max_rate`.

    The middle between the highest admissible function below and the lowest one above, so that a
    jump becomes a ramp centred on it.

    Args:
        time: Rising times [s], (n,).
        correction: Positions [m] and rotations [rad], (n, 6); both are limited to `max_rate`.
        max_rate: Largest rate [m/s] and [rad/s].

    Example:
        >>> time = np.linspace(0.0, 4.0, 5)
        >>> limit_rate(time, np.array([[0.0], [0.0], [0.0], [2.0], [2.0]]), 1.0).ravel()
        array([0. , 0. , 0.5, 1.5, 2. ])
    """
    allowed = max_rate * np.diff(time)[:, None]
    if np.all(np.abs(np.diff(correction, axis=0)) <= allowed):
        return correction
    below, above = correction.copy(), correction.copy()
    for k in range(1, len(time)):
        below[k] = np.minimum(below[k], below[k - 1] + allowed[k - 1])
        above[k] = np.maximum(above[k], above[k - 1] - allowed[k - 1])
    for k in range(len(time) - 2, -1, -1):
        below[k] = np.minimum(below[k], below[k + 1] + allowed[k])
        above[k] = np.maximum(above[k], above[k + 1] - allowed[k])
    return 0.5 * (below + above)
