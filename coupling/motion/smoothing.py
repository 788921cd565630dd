"""The motors' motion without the noise of their encoders, and what of it is left."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy.signal import butter, sosfiltfilt

# Order of the filter in one direction; there and back it has none of a phase and twice this order.
_ORDER = 3


def smooth(values: np.ndarray, step: float, bandwidth: float) -> np.ndarray:
    """Return columns without what is faster than a bandwidth, their phase as it was.

    A Butterworth filter runs forwards and backwards over the rows.

    Args:
        values: Rows at equal times, (n, k), any unit.
        step: Step of time [s].
        bandwidth: Half power [Hz]; at or above half the sampling rate nothing is filtered.

    Example:
        >>> time = 0.004 * np.arange(1000)
        >>> slow = np.sin(2.0 * np.pi * 1.0 * time)[:, None]
        >>> bool(np.abs(smooth(slow, 0.004, 20.0) - slow)[100:-100].max() < 1e-4)
        True
    """
    if bandwidth >= 0.5 / step:
        return values
    sections = butter(_ORDER, bandwidth, fs=1.0 / step, output="sos")
    length = min(len(values) - 1, round(2.0 / (bandwidth * step)))
    filtered: np.ndarray = sosfiltfilt(sections, values, axis=0, padlen=length)
    return filtered


@dataclass(frozen=True)
class SmoothedMotion:
    """Smoothed motion of the motors, n rows of j.

    Attributes:
        q, qd, qdd: Angle [rad], rate [rad/s] and acceleration [rad/s^2], (n, j).
        noise: Standard deviation of the acceleration at rest [rad/s^2], (j,): what the encoders' noise
            leaves of itself.
        fast: What is faster than the bandwidth [rad], (n, j).
    """

    q: np.ndarray
    qd: np.ndarray
    qdd: np.ndarray
    noise: np.ndarray
    fast: np.ndarray

    @classmethod
    def of(cls, motor: np.ndarray, step: float, bandwidth: float) -> SmoothedMotion:
        """Return the motion of measured angles [rad], (n, j), below a bandwidth [Hz]."""
        q = smooth(motor, step, bandwidth)
        qd = np.gradient(q, step, axis=0, edge_order=2)
        qdd = smooth(np.gradient(qd, step, axis=0, edge_order=2), step, bandwidth)
        quiet = max(len(q) // 20, 20)
        # The quietest stretch is one at rest, if there is one.
        rough = qdd - smooth(qdd, step, bandwidth / 4.0)
        parts = np.array_split(rough, max(len(q) // quiet, 1))
        noise = np.min([part.std(axis=0) for part in parts], axis=0)
        return cls(q, qd, qdd, noise, motor - q)
