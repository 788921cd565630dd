"""Positions along a tool path at which the sheet's equilibrium is found."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

# A metre of depth counts as so many metres along the sheet: forces change faster with it.
_DEPTH_WEIGHT = 6.0
# A turn of the path by more than this angle is a position of its own [rad].
_CORNER = 0.5
# Moves below this have no direction [m].
_STANDSTILL = 1e-7


@dataclass(frozen=True)
class Schedule:
    """Positions on a path, chosen on the desired one so that every evaluation has the same.

    Attributes:
        positions: Indices of samples, rising, (m,).
        arc: Arc length at all samples [m], (n,), to interpolate along.
    """

    positions: np.ndarray
    arc: np.ndarray

    def interpolated(self, values: np.ndarray) -> np.ndarray:
        """Return values (m, k) at the positions, interpolated at all samples, (n, k), in their unit."""
        at = self.arc[self.positions]
        return np.column_stack([np.interp(self.arc, at, column) for column in values.T])


def schedule(points: np.ndarray, spacing: float) -> Schedule:
    """Choose the positions: at corners, and about `spacing` apart, closer in depth.

    Args:
        points: Desired TCP in the part frame [m], (n, 3).
        spacing: Distance of positions [m].

    Example:
        >>> line = np.column_stack([np.linspace(0.0, 0.01, 11), np.zeros(11), np.zeros(11)])
        >>> schedule(line, 0.003).positions
        array([ 0,  3,  6,  9, 10])
    """
    moves = np.diff(points, axis=0)
    lengths = np.linalg.norm(moves, axis=1)
    weighted = np.linalg.norm(moves * [1.0, 1.0, _DEPTH_WEIGHT], axis=1)
    corner = np.zeros(len(points), dtype=bool)
    moving = np.flatnonzero(lengths > _STANDSTILL)
    directions = moves[moving] / lengths[moving, None]
    turns = np.sum(directions[1:] * directions[:-1], axis=1) < np.cos(_CORNER)
    corner[moving[1:][turns]] = True
    chosen, since = [0], 0.0
    for k in range(1, len(points)):
        since += weighted[k - 1]
        if since >= spacing * (1.0 - 1e-9) or corner[k] or k == len(points) - 1:
            chosen.append(k)
            since = 0.0
    positions = np.array(chosen)
    return Schedule(positions, np.concatenate([[0.0], np.cumsum(lengths)]))
