"""Lags of first order at even times.

SciPy's `lfilter` computes their recursion as well; its package takes half a second to import.
"""

from __future__ import annotations

import numpy as np
from scipy.linalg.blas import dtbsv


def lagged(values: np.ndarray, step: float, time_constant: float, start: float) -> np.ndarray:
    """Return y of  T y' = u - y,  y(0) given, any unit, (n,), at even times; u is straight in between.

    Args:
        values: u, in the same unit, (n,).
        step: Distance of the times [s].
        time_constant: T [s], > 0.
        start: y at the first time.

    Example:
        >>> lagged(np.array([1.0, 1.0, 1.0]), step=1.0, time_constant=1.0, start=0.0).round(3)
        array([0.   , 0.632, 0.865])
    """
    ratio = step / time_constant
    decay, mean = np.exp(-ratio), -np.expm1(-ratio) / ratio
    before, now = mean - decay, 1.0 - mean
    pushed = now * values[1:] + before * values[:-1]
    # y_k = decay y_(k-1) + pushed_k of all k: a matrix that has ones and, below them, -decay.
    pushed[0] += decay * start
    band = np.full((2, len(pushed)), -decay, order="F")
    return np.append(start, dtbsv(1, band, pushed, lower=1, diag=1, overwrite_x=1))
