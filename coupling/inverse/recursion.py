"""First-order recursions, as lags have them from sample to sample.

SciPy's `lfilter` computes them as well; its package takes half a second to import.
"""

from __future__ import annotations

import numpy as np
from scipy.linalg.blas import dtbsv


def recursion(pushed: np.ndarray, keeps: float, before: float) -> np.ndarray:
    """Return y of  y_k = keeps y_(k-1) + u_k,  any unit, (n,).

    It solves the equations of all samples, whose matrix has ones and, below them, -keeps.

    Args:
        pushed: u, in the same unit, (n,), n > 0.
        keeps: What is left of a value a sample later.
        before: y a sample before the first one.

    Example:
        >>> recursion(np.array([1.0, 1.0, 0.0]), keeps=0.5, before=4.0)
        array([3.  , 2.5 , 1.25])
    """
    band = np.full((2, len(pushed)), -keeps, order="F")
    right = np.array(pushed, dtype=float)
    right[0] += keeps * before
    solved: np.ndarray = dtbsv(1, band, right, lower=1, diag=1, overwrite_x=1)
    return solved
