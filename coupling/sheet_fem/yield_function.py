"""Yld91: the effective stress of an orthotropic sheet in plane stress [Barlat1991].

With S1, S2, S3 the principal values of the stress turned into the sheet's own by six coefficients,

    2 s^m = |S1 - S2|^m + |S2 - S3|^m + |S3 - S1|^m.

In plane stress, with d = (S_xx - S_yy)/2, t = S_xy, r = sqrt(d^2 + t^2) and p = 3 (S_xx + S_yy)/2, the
differences are 2 r, p - r and p + r: for an even m, s^m is a polynomial in p^2 and r^2 without negative
coefficients.  It is smooth everywhere but at zero, also where principal values cross, and as exact.
"""

from __future__ import annotations

from math import comb
from typing import NamedTuple

import numpy as np

from coupling.sheet_fem.compiled import internal


def effective_terms(exponent: int) -> np.ndarray:
    """Return the coefficients c of s^m = sum c_j (p^2)^(k - j) (r^2)^j with k = m/2, (k + 1,).

    Example:
        >>> effective_terms(2), effective_terms(8)  # p^2 + 3 r^2, von Mises; the one for aluminium
        (array([1., 3.]), array([  1.,  28.,  70.,  28., 129.]))
    """
    terms = np.array([float(comb(exponent, 2 * j)) for j in range(exponent // 2 + 1)])
    terms[-1] += 2.0 ** (exponent - 1)
    return terms


class Effective(NamedTuple):
    """Effective stress, and its derivatives by x = p^2 and y = r^2.

    Attributes:
        stress: Effective stress, s.
        x, y: First derivatives.
        xx, xy, yy: Second derivatives.
    """

    stress: float
    x: float
    y: float
    xx: float
    xy: float
    yy: float


@internal
def effective(terms: np.ndarray, p: float, d: float, t: float) -> Effective:
    """Return the effective stress [Pa] of p, d, t, terms as (k + 1,); NaN where there is no stress.

    It is sqrt(X) F(q), X the larger one of x and y, q <= 1 the smaller one over it and
    F(q) = f(q)^(1/m) with the polynomial f: nothing overflows.
    """
    x, y = p * p, d * d + t * t
    degree = len(terms) - 1
    f1, f2 = 0.0, 0.0  # f' and f''/2, by Horner's scheme
    if x >= y:
        large, q, f = x, y / x, terms[degree]
        for j in range(degree - 1, -1, -1):
            f2 = f2 * q + f1
            f1 = f1 * q + f
            f = f * q + terms[j]
    else:
        large, q, f = y, x / y, terms[0]
        for j in range(1, degree + 1):
            f2 = f2 * q + f1
            f1 = f1 * q + f
            f = f * q + terms[j]
    inverse = 0.5 / degree  # 1/m
    F = f**inverse
    slope = f1 / f
    F1 = F * inverse * slope
    F2 = F * inverse * (2.0 * f2 / f - (1.0 - inverse) * slope * slope)
    root = np.sqrt(large)
    by_large, by_small = (0.5 * F - q * F1) / root, F1 / root
    cube = 1.0 / (large * root)
    twice_large = cube * (q * (F1 + q * F2) - 0.25 * F)
    mixed = -cube * (0.5 * F1 + q * F2)
    twice_small = cube * F2
    if x >= y:
        return Effective(root * F, by_large, by_small, twice_large, mixed, twice_small)
    return Effective(root * F, by_small, by_large, twice_small, mixed, twice_large)
