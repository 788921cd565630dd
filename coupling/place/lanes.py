"""Vectors, rotations and small systems of equations in many lanes: components first, lanes last."""

from __future__ import annotations

from collections.abc import Iterable

import numpy as np

Columns = list[np.ndarray]

# Part of a matrix's mean eigenvalue by which all may differ from it and are the same.
_ROUND = 1e-12


def cross(a: np.ndarray, b: np.ndarray) -> np.ndarray:
    """Return a x b, (3, n)."""
    x, y, z = a
    u, v, w = b
    product: np.ndarray = np.empty(np.broadcast_shapes(a.shape, b.shape))
    product[0] = y * w - z * v
    product[1] = z * u - x * w
    product[2] = x * v - y * u
    return product


def dot(a: np.ndarray, b: np.ndarray) -> np.ndarray:
    """Return a . b, (n,)."""
    product: np.ndarray = a[0] * b[0]
    for x, y in zip(a[1:], b[1:], strict=True):
        product += x * y
    return product


def combined(columns: Columns, weights: Iterable[float]) -> np.ndarray:
    """Return R v of rotations given by their columns and one vector v for all lanes, (3, n).

    Args:
        columns: Three of (3, n).
        weights: v, (3,).
    """
    total = np.zeros_like(columns[0])
    for column, weight in zip(columns, weights, strict=True):
        if weight == 1.0:
            total += column
        elif weight != 0.0:
            total += weight * column
    return total


def turned(columns: Columns, axis: np.ndarray, angle: np.ndarray) -> Columns:
    """Return R Rot(axis, angle) by its columns (Rodrigues).

    Args:
        columns: Those of R.
        axis: Unit vector, the same in all lanes, (3,).
        angle: [rad], (n,).
    """
    sin, cos = np.sin(angle), np.cos(angle)
    along = combined(columns, axis)
    x, y, z = axis.tolist()
    across = ([0.0, z, -y], [-z, 0.0, x], [y, -x, 0.0])  # axis x unit vectors
    found = []
    for column, part, other in zip(columns, (x, y, z), across, strict=True):
        if abs(part) == 1.0:
            found.append(column)
            continue
        new = cos * column + sin * combined(columns, other)
        if part != 0.0:
            new += ((1.0 - cos) * part) * along
        found.append(new)
    return found


def applied(columns: Columns, vector: np.ndarray) -> np.ndarray:
    """Return R v, (3, n)."""
    return columns[0] * vector[0] + columns[1] * vector[1] + columns[2] * vector[2]


def seen_from(columns: Columns, vector: np.ndarray) -> np.ndarray:
    """Return R^T v, (3, n)."""
    return np.stack([dot(column, vector) for column in columns])


class Factor:
    """Cholesky's factor of symmetric matrices, L L^T = A, in every lane.

    Args:
        matrix: A, positive definite, (k, k, n); its lower triangle is used.
    """

    def __init__(self, matrix: np.ndarray) -> None:
        size = len(matrix)
        self._lower = np.zeros_like(matrix)
        self._inverse_diagonal = np.empty(matrix.shape[1:])
        for j in range(size):
            column = matrix[j:, j].copy()
            for k in range(j):
                column -= self._lower[j:, k] * self._lower[j, k]
            self._inverse_diagonal[j] = 1.0 / np.sqrt(column[0])
            self._lower[j:, j] = column * self._inverse_diagonal[j]

    def solve(self, right: np.ndarray) -> np.ndarray:
        """Return A^-1 b, (k, n)."""
        x = right.copy()
        for j in range(len(x)):
            x[j] *= self._inverse_diagonal[j]
            x[j + 1 :] -= self._lower[j + 1 :, j] * x[j]
        for j in range(len(x) - 1, -1, -1):
            x[j] -= dot(self._lower[j + 1 :, j], x[j + 1 :]) if j + 1 < len(x) else 0.0
            x[j] *= self._inverse_diagonal[j]
        return x

    def inverse_trace(self) -> np.ndarray:
        """Return the trace of A^-1, (n,): the sum of squares of L^-1."""
        total = np.zeros(self._lower.shape[2])
        size = len(self._lower)
        for k in range(size):
            x = np.zeros((size, self._lower.shape[2]))
            x[k] = 1.0
            for j in range(k, size):
                x[j] *= self._inverse_diagonal[j]
                x[j + 1 :] -= self._lower[j + 1 :, j] * x[j]
                total += x[j] ** 2
        return total


def largest_eigenvalue(matrix: np.ndarray) -> np.ndarray:
    """Return the largest eigenvalue of symmetric matrices, (n,), in closed form (Smith 1961).

    Args:
        matrix: (3, 3, n).
    """
    mean = (matrix[0, 0] + matrix[1, 1] + matrix[2, 2]) / 3.0
    x, y, z = (matrix[k, k] - mean for k in range(3))
    a, b, c = matrix[0, 1], matrix[0, 2], matrix[1, 2]
    size = np.sqrt((x**2 + y**2 + z**2 + 2.0 * (a**2 + b**2 + c**2)) / 6.0)
    scale = np.where(size > _ROUND * np.abs(mean), size, np.inf)
    half = (x * (y * z - c**2) - a * (a * z - c * b) + b * (a * c - y * b)) / (2.0 * scale**3)
    largest: np.ndarray = mean + 2.0 * size * np.cos(np.arccos(np.clip(half, -1.0, 1.0)) / 3.0)
    return largest
