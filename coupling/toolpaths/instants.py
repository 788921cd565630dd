"""Times at which a process is evaluated along a path, and the shorter steps of the path."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from coupling.path.histories import ToolPath
from coupling.path.interpolation import InterpolatedPath, divide_steps

# Longest step of a path [s]: a quintic spline through rows 4 ms apart stays within 1 nm of
# a motion that reaches 0.25 m/s in 0.2 s, where one through rows 20 ms apart leaves 0.4 um.
MAX_STEP = 0.004
# Instants are one if they are closer than this part of the sampling period, or of MAX_STEP where that is
# the shorter one: splines through rows of very different steps ring.
_SAME_INSTANT_PART, _NEAR_MAX_STEP = 0.1, 1.0 / 3.0

# Times at which a process is to be evaluated beside the usual ones [s].
Corners = np.ndarray
NO_CORNERS: Corners = np.zeros(0)


@dataclass(frozen=True)
class PathTimes:
    """Times of a path.

    Attributes:
        time: Times of the path, rising from 0 [s], (n,).
        sample_rows: Row numbers at which a process is evaluated, (k,).
    """

    time: np.ndarray
    sample_rows: np.ndarray

    @classmethod
    def of(cls, rests: np.ndarray, period: float, corners: Corners = NO_CORNERS) -> PathTimes:
        """Return the times of a motion.

        Between rests and corners, which are instants themselves, the steps are equal.

        Args:
            rests: Times at which the motion comes to rest, rising, the last one its end [s], (r,).
            period: Longest time between two samples [s].
            corners: Further times at which the process is evaluated; those next to a rest or to each
                other are one with it [s].

        Example:
            >>> instants = PathTimes.of(np.array([0.03]), 0.012)
            >>> len(instants.time), instants.time[instants.sample_rows].round(9)
            (10, array([0.  , 0.01, 0.02, 0.03]))
        """
        near = max(_SAME_INSTANT_PART * period, _NEAR_MAX_STEP * min(period, MAX_STEP))
        fixed = _apart(np.append(0.0, rests), corners, near)
        sample_rows = divide_steps(fixed, period)[0]
        return cls(*divide_steps(sample_rows, MAX_STEP))


def _apart(instants: np.ndarray, more: np.ndarray, near: float) -> np.ndarray:
    """Return times with those of others that are not near one that is kept already, rising."""
    inside = np.sort(more[(more > instants[0]) & (more < instants[-1])])
    after = np.searchsorted(instants, inside)
    free = inside[np.minimum(inside - instants[after - 1], instants[after] - inside) >= near]
    added: list[float] = []
    for time in free.tolist():
        if not added or time - added[-1] >= near:
            added.append(time)
    return np.sort(np.concatenate([instants, added]))


def insert_corners(path: ToolPath, corners: Corners) -> tuple[ToolPath, np.ndarray]:
    """Return a path with rows at corners, and the numbers of rows to evaluate a process at, (n,): all.

    Args:
        path: A path of one tool whose rows are its user's.
        corners: Times [s]; those next to a row are one with it.
    """
    inside = corners[(corners > path.time[0]) & (corners < path.time[-1])]
    after = np.searchsorted(path.time, inside)
    before, behind = inside - path.time[after - 1], path.time[after] - inside
    apart = inside[np.minimum(before, behind) >= _NEAR_MAX_STEP * (before + behind)]
    time = np.union1d(path.time, apart)
    pose = InterpolatedPath(path).at(time).pose if len(apart) else path.pose.copy()
    pose[:, np.searchsorted(time, path.time)] = path.pose
    return ToolPath(time, pose), np.arange(len(time))
