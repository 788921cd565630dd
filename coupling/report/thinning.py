"""Fewer points of long curves, without losing a peak."""

from __future__ import annotations

import numpy as np

# Parts of the time axis: about two for each of a figure's pixels.
PARTS = 1500


def extremes(time: np.ndarray, values: np.ndarray, parts: int = PARTS) -> np.ndarray:
    """Return the rows of the smallest and the largest value in each part of the time, and the ends.

    Args:
        time: Rising times [s], (n,).
        values: Values of the curve, any unit, (n,).
        parts: Number of equal parts of the time; up to twice as many values are kept whole.

    Example:
        >>> extremes(np.arange(9.0), np.array([0.0, 0, 5, 0, 0, 0, 0, -1, 0]), parts=2)
        array([0, 2, 4, 7, 8])
    """
    count = len(time)
    if count <= 2 * parts:
        return np.arange(count)
    edges = np.searchsorted(time, np.linspace(time[0], time[-1], parts + 1)[1:-1])
    starts = np.unique(np.append(0, edges[edges < count]))
    part = np.repeat(np.arange(len(starts)), np.diff(starts, append=count))
    rows = [np.array([0, count - 1])]
    for signed in (values, -values):
        at_most = np.flatnonzero(~(signed < np.maximum.reduceat(signed, starts)[part]))
        rows.append(at_most[np.flatnonzero(np.diff(part[at_most], prepend=-1))])
    return np.unique(np.concatenate(rows))


def rows_within(
    time: np.ndarray, values: np.ndarray, tolerance: np.ndarray, most: int
) -> np.ndarray:
    """Return the rows between which straight lines stay within a tolerance of all others.

    Rows are added where the lines are farthest off, all over the path at once, so that few passes are
    needed. Where `most` rows do not suffice the worst samples of each pass are among them.

    Args:
        time: Rising times [s], (n,).
        values: Quantities, any units, (n, k).
        tolerance: Largest error of each, in its unit, > 0, (k,).
        most: Largest number of rows.

    Returns:
        Rising row numbers with the first and the last.

    Example:
        >>> time = np.linspace(0.0, 1.0, 101)
        >>> corner = np.abs(time - 0.3)[:, None]
        >>> rows_within(time, corner, np.array([1e-6]), 50).tolist()
        [0, 30, 100]
    """
    count = len(time)
    rows, samples = np.unique([0, count - 1]), np.arange(count)
    scaled = np.ascontiguousarray((values / tolerance).T)
    while len(rows) < min(most, count):
        interval = np.searchsorted(rows, samples, side="right").clip(1, len(rows) - 1) - 1
        first, last = rows[interval], rows[interval + 1]
        share = (time[samples] - time[first]) / (time[last] - time[first])
        error, rest = np.zeros(len(samples)), 1.0 - share
        for quantity in scaled:  # by itself each stays in the processor's cache
            line = rest * quantity[first]
            line += share * quantity[last]
            np.subtract(quantity[samples], line, out=line)
            np.maximum(error, np.abs(line, out=line), out=error)
        starts = np.flatnonzero(np.diff(interval, prepend=-1))
        largest, sizes = np.maximum.reduceat(error, starts), np.diff(starts, append=len(samples))
        far = np.flatnonzero(largest > 1.0)
        if not len(far):
            break
        far = far[np.argsort(-largest[far], kind="stable")][: most - len(rows)]
        new = [starts[k] + int(error[starts[k] : starts[k] + sizes[k]].argmax()) for k in far]
        rows = np.union1d(rows, samples[new])
        # Lines that are close enough stay so.
        samples = samples[np.repeat(largest > 1.0, sizes)]
    return rows
