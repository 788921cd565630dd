"""Limits of a correction: its frequencies and its rate."""

from __future__ import annotations

import numpy as np
from scipy.signal import butter, sosfiltfilt

# Even times for each step of uneven ones at most.
_MOST_EVEN = 4


def low_pass(time: np.ndarray, correction: np.ndarray, cutoff: float) -> np.ndarray:
    """Return the part of a correction below a frequency, without delay, zero rates at the ends kept.

    Second-order Butterworth, forwards and backwards.

    Args:
        time: Rising [s], (n,); the filter works on even times as near as the nearest of these, straight
            pieces in between.
        correction: (n, k).
        cutoff: [Hz]; nothing is taken from a correction whose samples are too far apart for it.
    """
    duration, steps = float(time[-1] - time[0]), np.diff(time)
    count = min(round(duration / steps.min()), _MOST_EVEN * len(steps))
    even = np.linspace(time[0], time[-1], count + 1)
    rate = count / duration
    if cutoff >= 0.5 * rate:
        return correction
    sections = butter(2, cutoff, fs=rate, output="sos")
    padding = min(count, int(3.0 * rate / cutoff))
    told = _at(even, time, correction)
    filtered = sosfiltfilt(sections, told, axis=0, padtype="even", padlen=padding)
    return _at(time, even, filtered)


def _at(time: np.ndarray, known: np.ndarray, values: np.ndarray) -> np.ndarray:
    """Return values (n, k) between their times."""
    return np.column_stack([np.interp(time, known, column) for column in values.T])


def limit_rate(time: np.ndarray, correction: np.ndarray, max_rate: float) -> np.ndarray:
    """Return a correction of which no component changes faster than `max_rate`.

    The middle between the highest admissible function below and the lowest one above, so that a
    jump becomes a ramp centred on it.

    Args:
        time: Rising [s], (n,).
        correction: Positions [m] and rotations [rad], (n, 6); both are limited to `max_rate`.
        max_rate: [m/s] and [rad/s].

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
