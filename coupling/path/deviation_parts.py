"""Deviation under a periodic process: slow part, ripple of a mill's teeth, walls of the cut."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy.interpolate import make_interp_spline

# Half a period more or less by this part of it ends at the same sample.
_ROUNDING = 1e-9


@dataclass(frozen=True)
class DeviationParts:
    """Parts of a deviation along a path.

    Attributes:
        slow: Its mean over a tooth period around each time [m], (n,) or (n, 3).
        ripple: Deviation less its slow part [m], shape of `slow`.
        lowest, highest: Its extremes within that period [m], shape of `slow`: where the walls and the
            floor of a cut lie at most, as an edge may be there when the tool is farthest off.
    """

    slow: np.ndarray
    ripple: np.ndarray
    lowest: np.ndarray
    highest: np.ndarray

    @property
    def largest_slow(self) -> float:
        """Largest size of the slow part [m]."""
        return float(np.linalg.norm(self.slow, axis=-1).max())

    @property
    def largest_ripple(self) -> float:
        """Largest size of the ripple [m]."""
        return float(np.linalg.norm(self.ripple, axis=-1).max())

    @classmethod
    def of(cls, time: np.ndarray, deviation: np.ndarray, period: float) -> DeviationParts:
        """Return the parts of a deviation.

        Args:
            time: Rising [s], (n,).
            deviation: [m], (n,) or (n, 3); straight between the times, constant beyond them.
            period: Period of the teeth [s].

        Example:
            >>> time = np.linspace(0.0, 1.0, 101)
            >>> parts = DeviationParts.of(time, 5.0 + np.sin(20.0 * np.pi * time), 0.1)
            >>> [round(float(v[50]), 6) for v in (parts.slow, parts.lowest)]
            [5.0, 4.048943]
        """
        half = 0.5 * period
        # A point of constant values far beyond either end stands for all of them.
        instants = np.concatenate([[time[0] - period], time, [time[-1] + period]])
        values = np.concatenate([deviation[:1], deviation, deviation[-1:]])
        integral = make_interp_spline(instants, values, k=1).antiderivative()
        slow = (integral(time + half) - integral(time - half)) / period
        within = half * (1.0 + _ROUNDING)
        first = np.searchsorted(time, time - within)
        last = np.searchsorted(time, time + within, side="right")
        rows = np.column_stack([first, last]).ravel()  # every other piece is that within a period
        padded = np.concatenate([deviation, deviation[-1:]])
        lowest, highest = (take.reduceat(padded, rows)[::2] for take in (np.minimum, np.maximum))
        return cls(slow, deviation - slow, lowest, highest)
