"""Matrices of a sheet's stiffness in full, element by element."""

import numpy as np

from coupling.sheet_fem.banded import GeneralBanded, SymmetricBanded
from coupling.sheet_fem.border import Bordered


def full_of(matrix: Bordered) -> np.ndarray:
    """Return a bordered band matrix, any unit, (n + m, n + m)."""
    inner = _band(matrix.inner)
    return np.block([[inner, matrix.across], [matrix.across.T, matrix.outer]])


def _band(matrix: SymmetricBanded | GeneralBanded) -> np.ndarray:
    if isinstance(matrix, SymmetricBanded):
        lower = _filled(matrix.lower, 0)
        return lower + np.tril(lower, -1).T
    return _filled(matrix.columns, 2 * (matrix.columns.shape[1] - 1) // 3)


def _filled(columns: np.ndarray, diagonal: int) -> np.ndarray:
    """Return the matrix of columns, (n, entries), whose diagonal stands at a number of them."""
    dense = np.zeros((len(columns), len(columns)))
    for column, entries in enumerate(columns):
        for place in np.flatnonzero(entries).tolist():
            dense[column + place - diagonal, column] = entries[place]
    return dense
