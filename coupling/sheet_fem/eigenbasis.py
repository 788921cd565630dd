"""Principal axes of the midsurface's metric, and the turns into them and back."""

from __future__ import annotations

import numpy as np

from coupling.sheet_fem.compiled import inlined
from coupling.sheet_fem.logarithm import divided_differences


@inlined
def eigenbasis(
    a: np.ndarray, F: np.ndarray, into: np.ndarray, out: np.ndarray
) -> tuple[float, float]:
    """Return the eigenvalues of the first fundamental form a11, a22, a12, the larger one first.

    Tensors and stresses are vectors (11, 22, 12), strains (11, 22, 2*12): what turns the ones into
    the axes in which the metric is diagonal, transposed, turns the others out of them.

    Args:
        a: First fundamental form [1], (3,).
        F: Written: divided differences of ln/2 of the eigenvalues [1], (5, 5).
        into: Written: matrix that turns tensors from material axes into the eigenbasis, (3, 3).
        out: Written: matrix that turns strains from the eigenbasis into material axes, (3, 3).
    """
    mean, half = 0.5 * (a[0] + a[1]), 0.5 * (a[0] - a[1])
    radius = np.sqrt(half * half + a[2] * a[2])
    x1, x2 = mean + radius, mean - radius
    # Cosine and sine of twice the angle from the material axes.
    cosine, sine = 1.0, 0.0
    if radius > 0.0:
        cosine, sine = half / radius, a[2] / radius
    into[0, 0] = into[1, 1] = 0.5 * (1.0 + cosine)
    into[0, 1] = into[1, 0] = 0.5 * (1.0 - cosine)
    into[0, 2], into[1, 2] = sine, -sine
    into[2, 0], into[2, 1], into[2, 2] = -0.5 * sine, 0.5 * sine, cosine
    for i in range(3):
        for j in range(3):
            out[i, j] = into[j, i]
    divided_differences(x1, x2, F)
    return x1, x2


@inlined
def turn(matrix: np.ndarray, vectors: np.ndarray, turned: np.ndarray) -> None:
    """Fill `turned` with the matrix times each vector of three, (3,) or (6,)."""
    for p in range(0, len(vectors), 3):
        for i in range(3):
            total = 0.0
            for j in range(3):
                total += matrix[i, j] * vectors[p + j]
            turned[p + i] = total


@inlined
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
