"""The wrench on a tool as links on nodes can feel it."""

from __future__ import annotations

import numpy as np

from coupling.path.histories import WrenchHistory
from coupling.path.linear import interpolated

# Steps of the grid on which a wrench is smoothed, in a distance of nodes.
_PARTS = 16
# Times that a mean over one distance is taken in the wider of the two kernels.
_WIDE = 4


class SmoothWrench:
    """A wrench without what is faster than nodes can follow, continuous in time.

    A wrench that jumps asks for links whose acceleration jumps.  Smoothed with a kernel K it moves the
    links to the same place at the same rate behind the jump if K has no first and second moment:
    K = 2 b^2 - b^4, with b the mean over a distance of nodes, repeated.  Of a frequency f it leaves
    1 - (1 - s)^2 with s = sinc^2(f width), little of the teeth of a mill.

    Args:
        history: Wrench on one tool; beyond its ends the outermost row acts.
        width: Distance of the nodes [s].

    Example:
        >>> force = np.array([[0.0, 0, 0], [0, 0, 0], [8, 0, 0]])
        >>> step = WrenchHistory.of_forces(np.array([0.0, 1.0, 1.0]), [force])
        >>> SmoothWrench(step, 0.2)(np.array([0.5, 1.0, 1.5]))[:, 0].round(9)
        array([0., 4., 8.])
    """

    def __init__(self, history: WrenchHistory, width: float) -> None:
        time, rows = history.time, history.wrench[0]
        corners, behind, before = history.instants, history.behind[0], history.before[0]
        step, margin = width / _PARTS, _WIDE * _PARTS
        count = int(np.ceil((time[-1] - time[0]) / step)) + 2 * margin
        # Cells of the grid, with the mean of the wrench in each; the values belong to their middles.
        edges = time[0] + step * (np.arange(count + 1) - margin)
        steps = np.diff(corners)[:, None]
        means = 0.5 * (behind[:-1] + before[1:])
        impulse = np.vstack([np.zeros(6), np.cumsum(means * steps, axis=0)])
        inside = np.clip(edges, time[0], time[-1])
        piece = (np.searchsorted(corners, inside, side="right") - 1).clip(0, len(steps) - 1)
        since = inside - corners[piece]
        slope = (before[1:] - behind[:-1]) / steps
        early = np.minimum(edges - time[0], 0.0)
        late = np.maximum(edges - time[-1], 0.0)
        self._smooth = np.empty((count, rows.shape[1]))
        # Axis by axis: a path of minutes has millions of cells.
        for axis in range(rows.shape[1]):
            rate = behind[piece, axis] + 0.5 * since * slope[piece, axis]
            until = impulse[piece, axis] + since * rate
            until += early * rows[0, axis] + late * rows[-1, axis]
            narrow = _mean_twice(np.diff(until) / step)
            self._smooth[:, axis] = 2.0 * narrow - _mean_twice(narrow)
        self._time = edges[:-1] + 0.5 * step

    def __call__(self, times: np.ndarray) -> np.ndarray:
        """Return the smoothed wrenches, (k, 6)."""
        return interpolated(times, self._time, self._smooth)


def _mean_twice(values: np.ndarray) -> np.ndarray:
    """Return the mean over a width around each value of a grid, taken twice, (k,).

    A width is an even number of cells: one mean reaches a cell less to the right, the other to the left.
    """
    half = _PARTS // 2
    return _mean(_mean(values, half), half - 1)


def _mean(values: np.ndarray, before: int) -> np.ndarray:
    """Return the means over a width that begins so many cells before each value, the ends continued."""
    first, last = np.repeat(values[:1], before), np.repeat(values[-1:], _PARTS - 1 - before)
    total = np.cumsum(np.concatenate([np.zeros(1), first, values, last]))
    mean: np.ndarray = (total[_PARTS:] - total[:-_PARTS]) / _PARTS
    return mean
