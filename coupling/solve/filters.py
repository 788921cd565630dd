"""Limits of a correction: its frequencies and its rate."""

from __future__ import annotations

import numpy as np
from scipy.signal import butter, sosfiltfilt

from coupling.errors import CouplingError


def low_pass(time: np.ndarray, correction: np.ndarray, cutoff: float) -> np.ndarray:
    """Return the part of a correction below a frequency, without delay, zero rates at the ends kept.

    Second-order Butterworth, forwards and backwards.

    Args:
        time: Evenly spaced [s], (n,).
        correction: (n, k).
        cutoff: [Hz].

    Raises:
        CouplingError: If the samples are uneven or too far apart for that frequency.
    """
    steps = np.diff(time)
    rate = 1.0 / float(np.mean(steps))
    if np.ptp(steps) > 1e-6 * np.mean(steps):
        raise CouplingError(
            "cutoff_Hz: expected a path with evenly spaced samples, got samples"
            f" {np.min(steps):.9g} to {np.max(steps):.9g} s apart"
        )
    if cutoff >= 0.5 * rate:
        return correction
    sections = butter(2, cutoff, fs=rate, output="sos")
    padding = min(len(time) - 1, int(3.0 * rate / cutoff))
    filtered: np.ndarray = sosfiltfilt(sections, correction, axis=0, padtype="even", padlen=padding)
    return filtered


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
