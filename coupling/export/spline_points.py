"""Few points through which a smooth curve keeps to a motion."""

from __future__ import annotations

import numpy as np
from scipy.interpolate import CubicSpline

from coupling.export.curves import Curve

# First distance of points, in candidates.
_COARSE = 64
# Points apart from each other that are left out at the same time: what one of them changes falls to a
# quarter from point to point.
_APART = 6
# Rounds of adding at most; each halves the distances that are too long.
_MOST_ROUNDS = 40


def spline_values(time: np.ndarray, values: np.ndarray, at: np.ndarray) -> np.ndarray:
    """Return the C2 cubic spline through values, at rest at both ends.

    Args:
        time: Times of the values, rising [s], (n,).
        values: (n, k).
        at: Times that are asked for [s], (m,).
    """
    if len(time) < 2:
        return np.repeat(values, len(at), axis=0)
    return CubicSpline(time, values, bc_type="clamped")(at)


def spline_points(
    curve: Curve, time: np.ndarray, candidates: np.ndarray, tolerance: np.ndarray
) -> np.ndarray:
    """Return rows of a motion through which `spline_values` stays within a tolerance.

    Points are added in the middle of every interval that leaves it, then left out where that does no
    harm.

    Args:
        curve: The motion.
        time: Of its samples [s], (n,).
        candidates: Rows that may be points, rising, with the first and the last one, (m,).
        tolerance: How far the curve may be off at the tool at every sample [m], (n,).

    Returns:
        Chosen rows, rising.
    """
    last = len(candidates) - 1
    chosen = np.unique(np.append(np.arange(0, last, _COARSE), last))
    chosen = _added(curve, time, candidates, chosen, tolerance)
    for first in range(_APART):
        chosen = _thinned(curve, time, candidates, chosen, tolerance, first)
    return candidates[_added(curve, time, candidates, chosen, tolerance)]


def _errors(curve: Curve, time: np.ndarray, tolerance: np.ndarray, rows: np.ndarray) -> np.ndarray:
    """Return the largest error over its tolerance in each interval, (points - 1,)."""
    values = spline_values(time[rows], curve.values[rows], time)
    errors = curve.errors(values, slice(None)) / tolerance
    return np.maximum.reduceat(errors, rows[:-1])


def _added(
    curve: Curve,
    time: np.ndarray,
    candidates: np.ndarray,
    chosen: np.ndarray,
    tolerance: np.ndarray,
) -> np.ndarray:
    """Return the points with others between them until every interval is within the tolerance."""
    for _ in range(_MOST_ROUNDS):
        bad = _errors(curve, time, tolerance, candidates[chosen]) > 1.0
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


def _thinned(
    curve: Curve,
    time: np.ndarray,
    candidates: np.ndarray,
    chosen: np.ndarray,
    tolerance: np.ndarray,
    first: int,
) -> np.ndarray:
    """Return the points without every `_APART`-th one that is not needed, from the `first` one on."""
    left_out = np.arange(1 + first, len(chosen) - 1, _APART)
    while len(left_out):
        kept = np.delete(chosen, left_out)
        bad = np.flatnonzero(_errors(curve, time, tolerance, candidates[kept]) > 1.0)
        if not len(bad):
            return kept
        # What is bad comes from the point left out nearest to it.
        middles = 0.5 * (kept[bad] + kept[bad + 1])
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
