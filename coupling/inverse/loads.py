"""The wrench on a tool as links on nodes can feel it."""

from __future__ import annotations

import numpy as np

from coupling.path.histories import WrenchHistory


class MeanWrench:
    """Mean of a held wrench over a width around each time, continuous in time.

    A wrench that jumps asks for links whose acceleration jumps, which nodes cannot follow; its mean
    over the distance of the nodes has the same impulse.  What is faster, as the teeth of a mill, is
    left out.

    Args:
        history: Wrench on one tool; beyond its ends the outermost row acts.
        width: [s].

    Example:
        >>> force = np.array([[0.0, 0, 0], [0, 0, 0], [8, 0, 0]])
        >>> step = WrenchHistory.of_forces(np.array([0.0, 1.0, 2.0]), [force])
        >>> MeanWrench(step, 0.5)(np.array([0.5, 1.0, 1.125, 1.5]))[:, 0]
        array([0., 4., 6., 8.])
    """

    def __init__(self, history: WrenchHistory, width: float) -> None:
        self._time, self._width = history.time, width
        rows = history.wrench[0]
        self._first, self._last = rows[0], rows[-1]
        steps = np.diff(history.time)[:, None]
        self._impulse = np.vstack([np.zeros(6), np.cumsum(rows[1:] * steps, axis=0)])

    def __call__(self, times: np.ndarray) -> np.ndarray:
        """Return the mean wrenches, (k, 6)."""
        half = 0.5 * self._width
        mean: np.ndarray = (self._until(times + half) - self._until(times - half)) / self._width
        return mean

    def _until(self, times: np.ndarray) -> np.ndarray:
        """Return the impulse since the first time [N s, N m s]."""
        inside = np.clip(times, self._time[0], self._time[-1])
        impulse = np.stack(
            [np.interp(inside, self._time, column) for column in self._impulse.T], axis=-1
        )
        before = np.minimum(times - self._time[0], 0.0)[:, None] * self._first
        after = np.maximum(times - self._time[-1], 0.0)[:, None] * self._last
        return impulse + before + after
