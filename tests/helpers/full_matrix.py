"""Matrices of a sheet's stiffness in full, element by element."""

import numpy as np

from coupling.sheet_fem.banded import GeneralBanded, SymmetricBanded
from coupling.sheet_fem.border import Bordered


def full_of(matrix: Bordered) -> np.ndarray:
    """Return a bordered band matrix, any unit, (n + m, n + m)."""
    inner = _band(matrix.inner)
    return np.block([[inner, matrix.across], [matrix.across.T, matrix.outer]])


def _band(matrix: SymmetricBanded | GeneralBanded) -> np.ndarray:
    symmetric = isinstance(matrix, SymmetricBanded)
    stored = matrix.lower if symmetric else matrix.columns
    above = 0 if symmetric else 2 * (stored.shape[1] - 1) // 3  # where a column's diagonal stands
    dense = np.zeros((len(stored), len(stored)))
    for column, entries in enumerate(stored):
        for place in np.flatnonzero(entries).tolist():
            dense[column + place - above, column] = entries[place]
    return dense + np.tril(dense, -1).T if symmetric else dense
