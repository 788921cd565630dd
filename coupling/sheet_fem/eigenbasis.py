"""Principal axes of the midsurface's metric, and the turns into them and back."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from coupling.sheet_fem.compiled import compiled
from coupling.sheet_fem.logarithm import divided_differences


class Eigenbasis(NamedTuple):
    """Axes in which the metric is diagonal.

    Tensors and stresses are vectors (11, 22, 12), strains (11, 22, 2*12): what turns the ones into
    these axes, transposed, turns the others out of them.

    Attributes:
        x1, x2: Eigenvalues, the larger one first.
        F: Their divided differences of ln/2, (5, 5).
        into: Matrix that turns tensors from material axes into the eigenbasis, (3, 3).
        out: Matrix that turns strains from the eigenbasis into material axes, (3, 3).
    """

    x1: float
    x2: float
    F: np.ndarray
    into: np.ndarray
    out: np.ndarray


@compiled
def eigenbasis(a: np.ndarray) -> Eigenbasis:
    """Return the eigenbasis of the first fundamental form a11, a22, a12."""
    mean, half = 0.5 * (a[0] + a[1]), 0.5 * (a[0] - a[1])
    radius = np.sqrt(half * half + a[2] * a[2])
    x1, x2 = mean + radius, mean - radius
    c, s = 1.0, 0.0
    if radius > 0.0:
        angle = 0.5 * np.arctan2(a[2], half)
        c, s = np.cos(angle), np.sin(angle)
    into = np.array(
        (
            (c * c, s * s, 2.0 * c * s),
            (s * s, c * c, -2.0 * c * s),
            (-c * s, c * s, c * c - s * s),
        )
    )
    F = np.empty((5, 5))
    divided_differences(x1, x2, F)
    return Eigenbasis(x1, x2, F, into, into.T.copy())


@compiled
def turn(matrix: np.ndarray, vectors: np.ndarray, turned: np.ndarray) -> None:
    """Fill `turned` with the matrix times each vector of three, (3,) or (6,)."""
    for p in range(0, len(vectors), 3):
        for i in range(3):
            total = 0.0
            for j in range(3):
                total += matrix[i, j] * vectors[p + j]
            turned[p + i] = total


@compiled
def turn_blocks(matrix: np.ndarray, blocks: np.ndarray, turned: np.ndarray) -> None:
    """Fill `turned` with Q B Q^T of each 3 x 3 block B of a symmetric (6, 6), Q being the matrix."""
    for p in range(0, 6, 3):
        for q in range(0, p + 1, 3):
            for i in range(3):
                half0, half1, half2 = 0.0, 0.0, 0.0
                for k in range(3):
                    half0 += matrix[i, k] * blocks[p + k, q]
                    half1 += matrix[i, k] * blocks[p + k, q + 1]
                    half2 += matrix[i, k] * blocks[p + k, q + 2]
                for j in range(3):
                    total = matrix[j, 0] * half0 + matrix[j, 1] * half1 + matrix[j, 2] * half2
                    turned[p + i, q + j] = turned[q + j, p + i] = total
