"""Deviation under a process that beats: slow part, ripple of a mill's teeth, walls of the cut."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from coupling.run.study import Run

# Largest difference of steps that count as even, by their mean.
_EVEN = 1e-6


@dataclass(frozen=True)
class Parts:
    """Parts of a deviation along a path.

    Attributes:
        slow: Its mean over a tooth period around each time [m], (n,) or (n, 3).
        ripple: What is left of it.
        lowest, highest: Its extremes within that period: where the walls and the floor of a cut lie at
            most, as an edge may be there when the tool is farthest off.
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
    def of(cls, time: np.ndarray, deviation: np.ndarray, period: float) -> Parts:
        """Return the parts of a deviation.

        Args:
            time: Even times [s], (n,).
            deviation: [m], (n,) or (n, 3); straight between the times, constant beyond them.
            period: Of the teeth [s].

        Example:
            >>> time = np.linspace(0.0, 1.0, 101)
            >>> parts = Parts.of(time, 5.0 + np.sin(20.0 * np.pi * time), 0.1)
            >>> [round(float(v[50]), 6) for v in (parts.slow, parts.lowest)]
            [5.0, 4.048943]
        """
        step = (time[-1] - time[0]) / (len(time) - 1)
        wide = int(np.ceil(0.5 * period / step))
        padded = np.pad(
            deviation, [(wide + 1, wide + 1), *[(0, 0)] * (deviation.ndim - 1)], mode="edge"
        )
        middle = 0.5 * (padded[1:] + padded[:-1])
        sums = np.concatenate([np.zeros_like(padded[:1]), np.cumsum(middle, axis=0)])
        half = 0.5 * period / step
        rows = np.arange(len(time)) + wide + 1
        slow = (_between(sums, padded, rows + half) - _between(sums, padded, rows - half)) / (
            2.0 * half
        )
        near = int(half)
        spans = np.lib.stride_tricks.sliding_window_view(padded, 2 * near + 1, axis=0)
        spans = spans[wide + 1 - near : wide + 1 - near + len(time)]
        return cls(slow, deviation - slow, spans.min(axis=-1), spans.max(axis=-1))


def _between(sums: np.ndarray, values: np.ndarray, place: np.ndarray) -> np.ndarray:
    """Return the integral of straight pieces up to places between their ends, in steps."""
    first = np.minimum(place.astype(int), len(values) - 2)
    part = (place - first).reshape(-1, *[1] * (values.ndim - 1))
    rise = values[first + 1] - values[first]
    integral: np.ndarray = sums[first] + part * (values[first] + 0.5 * part * rise)
    return integral


def beat_parts(run: Run) -> list[Parts] | None:
    """Return the parts of every tool's deviation after a run; None where its process does not beat.

    Neither are there any where the times are uneven or the period is longer than the path.
    """
    found = run.correction
    time, period = found.desired.time, found.answer.period
    steps = np.diff(time)
    uneven = np.ptp(steps) > _EVEN * steps.mean()
    if period is None or uneven or period > time[-1] - time[0]:
        return None
    deviation = found.achieved.position - found.desired.position
    return [Parts.of(time, own, period) for own in deviation]
