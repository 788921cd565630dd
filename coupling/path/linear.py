"""Histories that go straight from row to row."""

from __future__ import annotations

import numpy as np


def interpolate_rows(
    at: np.ndarray, time: np.ndarray, values: np.ndarray, axis: int = 0
) -> np.ndarray:
    """Return rows at other times; beyond the ends the end values hold.

    Args:
        at: Times [s] or arc lengths [m] to interpolate at, (k,).
        time: Rising times of the rows [s], (n,).
        values: The rows, any unit and shape, n of them along an axis.
        axis: Number of that axis, which is k long in what is returned.

    Example:
        >>> values = np.array([[0.0, 2.0], [1.0, 4.0]])
        >>> interpolate_rows(np.array([0.5, 3.0]), np.array([0.0, 1.0]), values)
        array([[0.5, 3. ],
               [1. , 4. ]])
    """
    # NumPy copies each column, so all rows would be copied for each block of a long history.
    near = slice(0, 1)
    if len(at):
        first = int(np.searchsorted(time, at.min()))
        near = slice(max(first - 1, 0), int(np.searchsorted(time, at.max(), "right")) + 1)
    time, rows = time[near], np.moveaxis(values, axis, 0)[near]
    columns = rows.reshape(len(time), -1).T
    values_at = np.empty((len(at), len(columns)))
    for k, column in enumerate(columns):
        values_at[:, k] = np.interp(at, time, column)
    return np.moveaxis(values_at.reshape(len(at), *rows.shape[1:]), 0, axis)


def arc_length(points: np.ndarray) -> np.ndarray:
    """Return the way from point to point [m], (n,), zero at the first of them, (n, 3).

    Example:
        >>> arc_length(np.array([[0.0, 0.0, 0.0], [3.0, 4.0, 0.0]]))
        array([0., 5.])
    """
    steps = np.linalg.norm(np.diff(points, axis=0), axis=1)
    return np.append(0.0, np.cumsum(steps))
