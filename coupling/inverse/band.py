"""Normal equations of least squares over a uniform spline: a banded matrix, assembled in place."""

from __future__ import annotations

import numpy as np
from scipy.linalg import LinAlgError, solveh_banded

from coupling.inverse.spline import stencil

# Added to the diagonal where rounding has made the matrix indefinite, relative to it; a Gauss-Newton
# iteration repairs what the next one finds.
_DAMPING = 1e-13

# Points whose products are formed at once: they fit into a processor's cache.
_CHUNK = 100


class NormalEquations:
    """Matrix and right-hand side of min |r + D c|^2 for the coefficients of a uniform spline.

    Args:
        intervals: Intervals of the spline.
        quantities: Quantities of the spline.
        degree: Its degree.
        spacing: Distance of its knots [s].
    """

    def __init__(self, intervals: int, quantities: int, degree: int, spacing: float) -> None:
        self._degree, self._spacing = degree, spacing
        self._rows, self._size = intervals + degree, quantities
        width = (degree + 1) * quantities
        # Entry [j, q, i] belongs to column (j, q) and the row that lies i below it.
        self._band = np.zeros((self._rows, quantities, width))
        self._gradient = np.zeros((self._rows, quantities))

    def add(self, first: int, place: float, squares: np.ndarray, gradient: np.ndarray) -> None:
        """Add points that lie at the same place of neighbouring intervals.

        Args:
            first: Number of the first interval.
            place: Part of an interval before its point.
            squares: D^T D, any unit, by value, rate, acceleration.. of the quantities,
                (k, orders, quantities, orders, quantities).
            gradient: D^T r, any unit, (k, orders, quantities).
        """
        count, orders, size = gradient.shape
        weights = np.stack(
            [stencil(np.array(place), self._degree, m) / self._spacing**m for m in range(orders)]
        )
        used = np.flatnonzero(np.any(weights != 0.0, axis=0)).tolist()
        pairs = [(i, j) for j in used for i in used if i >= j]
        both = np.array([np.outer(weights[:, i], weights[:, j]).ravel() for i, j in pairs])
        for begin in range(0, count, _CHUNK):
            chunk = squares[begin : begin + _CHUNK]
            by_order = chunk.transpose(1, 3, 0, 4, 2).reshape(orders**2, -1)
            products = (both @ by_order).reshape(len(pairs), len(chunk), size, size)
            self._add_blocks(first + begin, pairs, products)
        for j in used:
            self._gradient[first + j : first + j + count] += np.einsum(
                "m,kmq->kq", weights[:, j], gradient
            )

    def _add_blocks(self, first: int, pairs: list[tuple[int, int]], products: np.ndarray) -> None:
        """Add products (pairs, k, quantities, quantities) of rows i and columns j of k intervals."""
        count, size = products.shape[1:3]
        # Block [d, j, q, p] belongs to column (j, q) and row (j + d, p).
        blocks = np.zeros((self._degree + 1, count + self._degree, size, size))
        for (i, j), product in zip(pairs, products, strict=True):
            blocks[i - j, j : j + count] += product
        columns = self._band[first : first + count + self._degree]
        for q in range(size):
            columns[:, q, : size - q] += blocks[0, :, q, q:]
            for d in range(1, self._degree + 1):
                columns[:, q, d * size - q : (d + 1) * size - q] += blocks[d, :, q]

    def add_condition(
        self, start: int, row: np.ndarray, quantities: np.ndarray, residual: np.ndarray
    ) -> None:
        """Add one residual of some quantities, a combination of neighbouring coefficients.

        Args:
            start: Number of the first of these coefficients.
            row: Their weights, (k,).
            quantities: Numbers of the quantities, (m,).
            residual: Its value, any unit, (m,).
        """
        count, size = len(row), self._size
        for j in range(count):
            for i in range(j, count):
                self._band[start + j, quantities, (i - j) * size] += row[i] * row[j]
            self._gradient[start + j, quantities] += row[j] * residual

    @property
    def gradient(self) -> np.ndarray:
        """D^T r, in the residuals' unit, (intervals + degree, quantities)."""
        return self._gradient

    def solve(self) -> np.ndarray:
        """Return the coefficients, (intervals + degree, quantities); the matrix is used up."""
        width = self._band.shape[2]
        band = self._band.reshape(-1, width).T
        right = -self._gradient.ravel()
        try:
            solution = solveh_banded(band, right, lower=True, check_finite=False)
        except LinAlgError:
            band[0] *= 1.0 + _DAMPING
            solution = solveh_banded(band, right, lower=True, check_finite=False)
        return solution.reshape(self._rows, self._size)
