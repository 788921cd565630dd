"""Band matrices of the sheet's stiffness: symmetric without friction, general with it."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy.linalg.lapack import dgbtrf, dgbtrs, dpbtrf, dpbtrs

from coupling.sheet_fem.compiled import compiled

# Shift of the diagonal, relative to its mean, tried first where the stiffness is not definite.
_FIRST_SHIFT = 1e-4


@dataclass(frozen=True)
class SymmetricBanded:
    """A symmetric matrix by its lower band.

    Attributes:
        lower: Element (column + d, column) in [column, d], (n, 1 + bandwidth).
    """

    lower: np.ndarray

    @classmethod
    def of(cls, index: np.ndarray, stiffness: np.ndarray, size: int, width: int) -> SymmetricBanded:
        """Sum element matrices; arguments as of `GeneralBanded.of`."""
        lower = np.zeros((size, 1 + width))
        _place_lower(index, stiffness, lower)
        _hold(index, lower, 0)
        return cls(lower)

    def solve(self, right: np.ndarray) -> np.ndarray:
        """Return the solution by Cholesky's factors; a matrix that is not definite is shifted.

        Args:
            right: One right-hand side, (n,), or several, (n, k).
        """
        matrix = self.lower.T
        factor, status = dpbtrf(matrix, lower=1)
        shift = _FIRST_SHIFT * float(np.mean(np.abs(matrix[0])))
        while status != 0:
            shifted = matrix.copy(order="F")
            shifted[0] += shift
            factor, status = dpbtrf(shifted, lower=1, overwrite_ab=1)
            shift *= 10.0
        solution: np.ndarray = dpbtrs(factor, right, lower=1)[0]
        return solution

    def times(self, vector: np.ndarray) -> np.ndarray:
        """Return the product with a vector, (n,)."""
        result: np.ndarray = self.lower[:, 0] * vector
        for d in range(1, self.lower.shape[1]):
            result[d:] += self.lower[:-d, d] * vector[:-d]
            result[:-d] += self.lower[:-d, d] * vector[d:]
        return result


@dataclass(frozen=True)
class GeneralBanded:
    """A matrix with as many diagonals below as above, with LAPACK's room for its factors.

    Attributes:
        columns: Element (row, column) in [column, 2 bandwidth + row - column], (n, 1 + 3 bandwidth).
    """

    columns: np.ndarray

    @classmethod
    def of(cls, index: np.ndarray, stiffness: np.ndarray, size: int, width: int) -> GeneralBanded:
        """Sum element matrices.

        Args:
            index: Unknowns of the elements, -1 for what is held, (elements, 27).
            stiffness: Matrices of the elements, (elements, 27, 27).
            size: Number of unknowns, n.
            width: Bandwidth, of each side.
        """
        columns = np.zeros((size, 1 + 3 * width))
        _place_general(index, stiffness, 2 * width, columns)
        _hold(index, columns, 2 * width)
        return cls(columns)

    @property
    def _width(self) -> int:
        return (self.columns.shape[1] - 1) // 3

    def solve(self, right: np.ndarray) -> np.ndarray:
        """Return the solution by factors with pivots; of one right-hand side or several."""
        factor, pivots, _ = dgbtrf(self.columns.T, self._width, self._width)
        solution: np.ndarray = dgbtrs(factor, self._width, self._width, right, pivots)[0]
        return solution

    def times(self, vector: np.ndarray) -> np.ndarray:
        """Return the product with a vector, (n,)."""
        n, middle = len(vector), 2 * self._width
        result: np.ndarray = self.columns[:, middle] * vector
        for d in range(1, min(self._width + 1, n)):
            result[d:] += self.columns[:-d, middle + d] * vector[:-d]
            result[:-d] += self.columns[d:, middle - d] * vector[d:]
        return result


@compiled
def _place_lower(index: np.ndarray, stiffness: np.ndarray, lower: np.ndarray) -> None:
    for e in range(index.shape[0]):
        for i in range(27):
            column = index[e, i]
            if column < 0:
                continue
            for j in range(i - i % 3, 27):
                row = index[e, j]
                if row >= column:
                    lower[column, row - column] += stiffness[e, i, j]


@compiled
def _place_general(
    index: np.ndarray, stiffness: np.ndarray, middle: int, columns: np.ndarray
) -> None:
    for e in range(index.shape[0]):
        for i in range(27):
            row = index[e, i]
            if row < 0:
                continue
            for j in range(27):
                column = index[e, j]
                if column >= 0:
                    columns[column, middle + row - column] += stiffness[e, i, j]


def _hold(index: np.ndarray, band: np.ndarray, diagonal: int) -> None:
    """Put ones on the diagonal of what no element moves."""
    held = np.ones(len(band), dtype=bool)
    held[index[index >= 0]] = False
    band[held, diagonal] = 1.0
