"""Vectors and rotations in a batch: components first, batch last."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

Columns = list[np.ndarray]


def cross(a: np.ndarray, b: np.ndarray) -> np.ndarray:
    """Return a x b, any unit, (3, n)."""
    # Of a small batch np.cross takes twice as long, to arrange axes.
    (x, y, z), (u, v, w) = a, b
    return np.array([y * w - z * v, z * u - x * w, x * v - y * u])


def dot(a: np.ndarray, b: np.ndarray) -> np.ndarray:
    """Return a . b, any unit, (n,)."""
    return np.einsum("kn,kn->n", a, b)


def combine_columns(columns: Columns, weights: Sequence[float]) -> np.ndarray:
    """Return R v of rotations given by their columns and one vector v for the whole batch, (3, n).

    Args:
        columns: Three of (3, n).
        weights: v, (3,).
    """
    parts = [c if w == 1.0 else w * c for c, w in zip(columns, weights, strict=True) if w != 0.0]
    return sum(parts[1:], parts[0]) if parts else np.zeros_like(columns[0])


def rotate_columns(columns: Columns, axis: Sequence[float], angle: np.ndarray) -> Columns:
    """Return R Rot(axis, angle) by its columns (Rodrigues).

    Args:
        axis: Unit vector, the same in the whole batch, (3,).
        angle: Angles [rad], (n,).
    """
    sin, cos = np.sin(angle), np.cos(angle)
    for k, part in enumerate(axis):
        if abs(part) == 1.0:
            first, second = columns[k - 2], columns[k - 1]
            sin = part * sin
            rotated = [columns[k]] * 3
            rotated[k - 2], rotated[k - 1] = cos * first + sin * second, cos * second - sin * first
            return rotated
    along = combine_columns(columns, axis)
    x, y, z = axis
    across = ([0.0, z, -y], [-z, 0.0, x], [y, -x, 0.0])  # axis x unit vectors
    rotated = []
    for column, part, other in zip(columns, (x, y, z), across, strict=True):
        new = cos * column + sin * combine_columns(columns, other)
        if part != 0.0:
            new += ((1.0 - cos) * part) * along
        rotated.append(new)
    return rotated


def rotate_vector(columns: Columns, vector: np.ndarray) -> np.ndarray:
    """Return R v, any unit, (3, n)."""
    return columns[0] * vector[0] + columns[1] * vector[1] + columns[2] * vector[2]


def seen_from(columns: Columns, vector: np.ndarray) -> np.ndarray:
    """Return R^T v, any unit, (3, n)."""
    return np.stack([dot(column, vector) for column in columns])
