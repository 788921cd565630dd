"""Times of corners of a force along the desired path: its tool meets a sheet, a wall, a level."""

from __future__ import annotations

from collections.abc import Callable, Iterable

import numpy as np
from scipy.optimize import brentq

from coupling.path.frame import Frame
from coupling.path.histories import ToolPath
from coupling.path.interpolation import InterpolatedPath

# What is nearer to a surface lies on it [m].
_ON = 1e-9
# Times of corners are rounded to the nanosecond: the same wherever the part stands.
_DIGITS = 9


def crossings(path: ToolPath, distance: Callable[[np.ndarray], np.ndarray]) -> np.ndarray:
    """Return the times at which a tool crosses a surface, rising [s], (k,).

    A tool that rests on it on its way, or moves along it, is evaluated there as it rests.

    Args:
        distance: Function from positions (n, 3) to signed distances from the surface [m], (n,).

    Example:
        >>> time = np.linspace(0.0, 1.0, 51)
        >>> pose = np.zeros((51, 7)); pose[:, 2] = 0.01 * np.cos(np.pi * time); pose[:, 6] = 1.0
        >>> crossings(ToolPath(time, pose), lambda position: position[:, 2])
        array([0.5])
    """
    side = distance(path.position[0])
    off = np.flatnonzero(np.abs(side) > _ON)
    changes = np.sign(side[off[1:]]) != np.sign(side[off[:-1]])
    on_a_row = off[:-1][changes & (np.diff(off) == 2)] + 1
    before_crossing = off[:-1][changes & (np.diff(off) == 1)]
    between = InterpolatedPath(path)

    def away(time: float) -> float:
        return float(distance(between.position(np.array([time])))[0])

    roots = [brentq(away, *path.time[[k, k + 1]]) for k in before_crossing]
    return np.round(np.sort([*path.time[on_a_row], *roots]), _DIGITS)


def level_crossings(path: ToolPath, part: Frame, levels: Iterable[float]) -> np.ndarray:
    """Return the times at which a tool crosses heights along the part's z axis [m], rising [s], (k,)."""

    def above(level: float) -> Callable[[np.ndarray], np.ndarray]:
        return lambda position: part.coordinates(position)[:, 2] - level

    return np.sort(np.concatenate([np.zeros(0), *(crossings(path, above(z)) for z in levels)]))
