"""Few points through which a smooth curve keeps to a motion."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
from scipy.interpolate import CubicSpline

from coupling.export.curves import SampledCurve

# First distance of points, in candidates.
_FIRST_DISTANCE = 64
# Points apart from each other that are left out at the same time: what one of them changes falls to a
# quarter from point to point.
_REMOVAL_DISTANCE = 6
# Points beyond which a changed one makes no difference: 1e-14 of that at itself.
_REACH = 25
# Rounds of adding at most; each halves the distances that are too long.
_MOST_ROUNDS = 40

# Function from chosen candidates to whether each interval between them leaves the tolerance.
Outside = Callable[[np.ndarray], np.ndarray]


def spline_values(time: np.ndarray, values: np.ndarray, at: np.ndarray) -> np.ndarray:
    """Return the C2 cubic spline through values, at rest at both ends.

    Args:
        time: Times of the values, rising [s], (n,).
        values: Values, any unit, (n, k).
        at: Times that are asked for [s], (m,).
    """
    if len(time) < 2:
        return np.repeat(values, len(at), axis=0)
    return CubicSpline(time, values, bc_type="clamped")(at)


def spline_points(
    curve: SampledCurve, time: np.ndarray, candidates: np.ndarray, tolerance: np.ndarray
) -> np.ndarray:
    """Return rows of a motion through which `spline_values` stays within a tolerance.

    Points are added in the middle of every interval that leaves it, then left out where that does no
    harm.

    Args:
        time: Times of its samples [s], (n,).
        candidates: Numbers of rows that may be points, rising, the first and the last among them, (m,).
        tolerance: Largest distance of the curve at the tool, at every sample [m], (n,).

    Returns:
        Chosen rows, rising.
    """
    last, shares = len(candidates) - 1, np.empty(len(time))
    known = np.empty(0, dtype=int)

    def outside(chosen: np.ndarray) -> np.ndarray:
        """Return which intervals between chosen candidates leave the tolerance.

        Only those are looked at that another point has come or gone near to since the last call.
        """
        nonlocal known
        rows = candidates[chosen]
        near = _near(
            chosen, np.setxor1d(chosen, known, assume_unique=True) if len(known) else chosen
        )
        samples = np.flatnonzero(np.append(np.repeat(near, np.diff(rows)), near[-1]))
        known = chosen
        if len(samples):
            values = spline_values(time[rows], curve.values[rows], time[samples])
            shares[samples] = curve.errors(values, samples) / tolerance[samples]
        return np.maximum.reduceat(shares, rows[:-1]) > 1.0

    chosen = _add_points(outside, np.unique(np.append(np.arange(0, last, _FIRST_DISTANCE), last)))
    for first in range(_REMOVAL_DISTANCE):
        chosen = _remove_points(outside, chosen, first)
    return candidates[_add_points(outside, chosen)]


def _near(chosen: np.ndarray, changed: np.ndarray) -> np.ndarray:
    """Return which intervals between points are near to a point that has come or gone.

    Example:
        >>> _near(np.arange(0, 200, 2), np.array([100])).nonzero()[0][[0, -1]]
        array([25, 74])
    """
    after, count = np.searchsorted(chosen, changed), len(chosen) - 1
    ends = np.zeros(count + 1, dtype=int)
    np.add.at(ends, (after - _REACH).clip(0, count), 1)
    np.add.at(ends, (after + _REACH).clip(0, count), -1)
    return np.cumsum(ends[:-1]) > 0


def _add_points(outside: Outside, chosen: np.ndarray) -> np.ndarray:
    """Return the points with others between them until every interval is within the tolerance."""
    for _ in range(_MOST_ROUNDS):
        bad = outside(chosen)
        # An interval that cannot be divided is made better by its neighbours.
        single = np.diff(chosen) < 2
        if np.any(bad & single):
            spread = bad & single
            bad[1:] |= spread[:-1]
            bad[:-1] |= spread[1:]
        divided = np.flatnonzero(bad & ~single)
        if not len(divided):
            return chosen
        chosen = np.union1d(chosen, (chosen[divided] + chosen[divided + 1]) // 2)
    return chosen


def _remove_points(outside: Outside, chosen: np.ndarray, first: int) -> np.ndarray:
    """Return the points from `first` on without every `_REMOVAL_DISTANCE`-th that is not needed."""
    left_out = np.arange(1 + first, len(chosen) - 1, _REMOVAL_DISTANCE)
    while len(left_out):
        remaining = np.delete(chosen, left_out)
        bad = np.flatnonzero(outside(remaining))
        if not len(bad):
            return remaining
        # What is bad comes from the point left out nearest to it.
        middles = 0.5 * (remaining[bad] + remaining[bad + 1])
        places = chosen[left_out]
        after = np.searchsorted(places, middles).clip(1, max(len(places) - 1, 1))
        before = after - 1
        if len(places) == 1:
            return chosen
        nearer = np.where(
            np.abs(places[before] - middles) <= np.abs(places[after] - middles), before, after
        )
        left_out = np.delete(left_out, np.unique(nearer))
    return chosen
