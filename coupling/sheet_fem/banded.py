"""Band matrices of the sheet's stiffness: symmetric without friction, general with it."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy.linalg.lapack import dgbtrf, dgbtrs, dpbtrf, dtbtrs

from coupling.sheet_fem.compiled import compile_function
from coupling.sheet_fem.threads import in_threads

# Shift of the diagonal, relative to its mean, tried first where the stiffness is not definite.
_FIRST_SHIFT = 1e-4


@dataclass(frozen=True)
class Cholesky:
    """A symmetric matrix A = L L^T by the band of L.

    Attributes:
        lower: Element (column + d, column) in [column, d], (n, 1 + bandwidth).
    """

    lower: np.ndarray

    def forward(self, right: np.ndarray) -> np.ndarray:
        """Return L^-1 right, any unit, (n, k)."""
        solution = np.array(right, order="C")

        def solve(share: slice) -> None:
            _forward(self.lower, solution[:, share])

        in_threads(solve, solution.shape[1], _AT_ONCE)
        return solution

    def backward(self, half: np.ndarray) -> np.ndarray:
        """Return L^-T half, any unit, (n, k): with `forward` the solution."""
        solution: np.ndarray = dtbtrs(self.lower.T, half, uplo="L", trans="T")[0]
        return solution

    def adjoint(self, across: np.ndarray, half: np.ndarray) -> np.ndarray:
        """Return the matrix H, (n, k), with H^T forward(b) = across^T A^-1 b, from forward(across)."""
        return half


@dataclass(frozen=True)
class SymmetricBanded:
    """A symmetric matrix by its lower band.

    Attributes:
        lower: Element (column + d, column) in [column, d], (n, 1 + bandwidth).
    """

    lower: np.ndarray

    @classmethod
    def of(cls, index: np.ndarray, stiffness: np.ndarray, size: int, width: int) -> SymmetricBanded:
        """Sum element matrices, (n, n); arguments as of `GeneralBanded.of`."""
        lower = np.zeros((size, 1 + width))
        _place_lower(index, stiffness, lower)
        _hold(index, lower, 0)
        return cls(lower)

    def factor(self) -> Cholesky:
        """Return Cholesky's factors; a matrix that is not definite is shifted."""
        matrix = self.lower.T
        factor, status = dpbtrf(matrix, lower=1)
        shift = _FIRST_SHIFT * float(np.mean(np.abs(matrix[0])))
        while status != 0 and np.isfinite(shift):
            shifted = matrix.copy(order="F")
            shifted[0] += shift
            factor, status = dpbtrf(shifted, lower=1, overwrite_ab=1)
            shift *= 10.0
        return Cholesky(factor.T)


@dataclass(frozen=True)
class Pivoted:
    """Factors of a general band matrix A, (n, n), as LAPACK has them; same use as `Cholesky`.

    Attributes:
        factor: Band of L and U, any unit, (diagonals, n).
        pivots: Row numbers, (n,).
    """

    factor: np.ndarray
    pivots: np.ndarray

    def forward(self, right: np.ndarray) -> np.ndarray:
        """Return A^-1 right, (n, k): the whole solution."""
        width = (len(self.factor) - 1) // 3
        solution: np.ndarray = dgbtrs(self.factor, width, width, right, self.pivots)[0]
        return solution

    def backward(self, half: np.ndarray) -> np.ndarray:
        """Return `half`, any unit, (n, k): `forward` has solved already."""
        return half

    def adjoint(self, across: np.ndarray, half: np.ndarray) -> np.ndarray:
        """Return the matrix H, (n, k), with H^T forward(b) = across^T A^-1 b."""
        return across


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
            index: Numbers of the elements' unknowns, -1 for what is held, (elements, 27).
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

    def factor(self) -> Pivoted:
        """Return the factors with pivots."""
        return Pivoted(*dgbtrf(self.columns.T, self._width, self._width)[:2])


@compile_function
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


@compile_function
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
    is_fixed = np.ones(len(band), dtype=bool)
    is_fixed[index[index >= 0]] = False
    band[is_fixed, diagonal] = 1.0


# Right-hand sides that a core solves a triangle for at least: of fewer the products would be slow.
_AT_ONCE = 48
# Rows of a triangle that are solved for one by one; what is before them is one product of matrices.
_BLOCK = 24


@compile_function
def _forward(lower: np.ndarray, right: np.ndarray) -> None:
    """Solve L x = right in place; rows of zeros at the beginning cost nothing."""
    n, width, count = lower.shape[0], lower.shape[1] - 1, right.shape[1]
    part, products = right.copy(), np.empty((_BLOCK, count))
    before = np.empty((width, _BLOCK))  # columns of L, as far as the block's rows have them
    begin = 0
    while begin < n and not np.any(part[begin]):
        begin += 1
    for first in range(begin, n, _BLOCK):
        last = min(first + _BLOCK, n)
        start = max(begin, first - width)
        for j in range(start, first):
            end = min(last, j + width + 1)
            for i in range(first, end):
                before[j - start, i - first] = lower[j, i - j]
            before[j - start, end - first :] = 0.0
        if start < first:
            np.dot(before[: first - start].T, part[start:first], products)
            for i in range(first, last):
                for c in range(count):
                    part[i, c] -= products[i - first, c]
        for j in range(first, last):
            for c in range(count):
                part[j, c] /= lower[j, 0]
            for i in range(j + 1, min(last, j + width + 1)):
                factor = lower[j, i - j]
                for c in range(count):
                    part[i, c] -= factor * part[j, c]
    for i in range(n):
        for c in range(count):
            right[i, c] = part[i, c]
