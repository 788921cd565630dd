"""Principal axes of the midsurface's metric, turns into them, derivatives of its logarithm.

With f(x) = ln(x)/2 and eigenvalues x1, x2, the k-th derivative of the matrix function f in the
eigenbasis has the coefficients f[x1, .., x1, x2, .., x2] of k + 1 arguments [Higham2008].
"""

from __future__ import annotations

from math import comb

import numpy as np

from coupling.sheet_fem.compiled import compile_inlined

# Below this relative distance of the eigenvalues the recursion would cancel; the series then ends
# with a relative error of _CLOSE_EIGENVALUES**_SERIES_TERMS.
_CLOSE_EIGENVALUES = 0.02
_SERIES_TERMS = 9


def _series_coefficients() -> np.ndarray:
    """Return h_k(1 p times, -1 q times), the complete homogeneous polynomials, (4, 4, _SERIES_TERMS)."""
    table = np.zeros((4, 4, _SERIES_TERMS))
    for p in range(1, 4):
        for q in range(1, 4):
            for k in range(_SERIES_TERMS):
                table[p, q, k] = sum(
                    comb(p - 1 + i, i) * comb(q - 1 + k - i, k - i) * (-1) ** (k - i)
                    for i in range(k + 1)
                )
    return table


_COEFFICIENTS = _series_coefficients()


@compile_inlined
def _by_series(p: int, q: int, mean: float, r: float) -> float:
    """Return f[x1 p times, x2 q times] for x1, x2 = mean (1 + r), mean (1 - r) from a series."""
    order = p + q - 1
    total, power = 0.0, 1.0
    sign = 1.0 if order % 2 == 1 else -1.0
    for k in range(_SERIES_TERMS):
        total += sign * _COEFFICIENTS[p, q, k] * power / (order + k)
        power *= r
        sign = -sign
    return 0.5 * total / mean**order


@compile_inlined
def divided_differences(x1: float, x2: float, table: np.ndarray) -> None:
    """Fill table[p, q] with f[x1 p times, x2 q times] for f = ln/2 and 2 <= p + q <= 4.

    Args:
        x1: First eigenvalue, > 0.
        x2: Second eigenvalue, > 0.
        table: Written: the differences [1], (5, 5).

    Example:
        >>> table = np.zeros((5, 5))
        >>> divided_differences.py_func(2.0, 1.0, table)
        >>> bool(np.isclose(table[1, 1], 0.5 * np.log(2.0)))
        True
    """
    table[2, 0] = 0.5 / x1
    table[0, 2] = 0.5 / x2
    table[3, 0] = -0.25 / x1**2
    table[0, 3] = -0.25 / x2**2
    table[4, 0] = 1.0 / (6.0 * x1**3)
    table[0, 4] = 1.0 / (6.0 * x2**3)
    mean = 0.5 * (x1 + x2)
    distance = x1 - x2
    r = 0.5 * distance / mean
    if abs(r) < _CLOSE_EIGENVALUES:
        for p in range(1, 4):
            for q in range(1, 5 - p):
                table[p, q] = _by_series(p, q, mean, r)
        return
    table[1, 1] = 0.5 * np.log(x1 / x2) / distance
    table[2, 1] = (table[2, 0] - table[1, 1]) / distance
    table[1, 2] = (table[1, 1] - table[0, 2]) / distance
    table[3, 1] = (table[3, 0] - table[2, 1]) / distance
    table[2, 2] = (table[2, 1] - table[1, 2]) / distance
    table[1, 3] = (table[1, 2] - table[0, 3]) / distance


@compile_inlined
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


@compile_inlined
def turn(matrix: np.ndarray, vectors: np.ndarray, product: np.ndarray) -> None:
    """Fill `turned` with the matrix times each vector of three, (3,) or (6,)."""
    for p in range(0, len(vectors), 3):
        for i in range(3):
            total = 0.0
            for j in range(3):
                total += matrix[i, j] * vectors[p + j]
            product[p + i] = total


@compile_inlined
def turn_blocks(matrix: np.ndarray, blocks: np.ndarray, product: np.ndarray) -> None:
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
                    product[p + i, q + j] = product[q + j, p + i] = total
