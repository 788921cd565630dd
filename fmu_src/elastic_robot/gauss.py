"""Coefficients of the four-stage Gauss collocation method for second-order equations.

The accelerations a_i at the Gauss points c_i give, for a step of length h from x_0, v_0,

    x_i = x_0 + c_i h v_0 + h^2 sum_j A2_ij a_j,      v_i = v_0 + h sum_j A1_ij a_j,

with A1 of the Gauss method for first-order equations and A2 = A1 A1, so that the method is A-stable,
symplectic and of order 8 at the step's end (Hairer, Lubich, Wanner 2006, sec. II.1; docs/references.md).
Integrating the cubic through the a_i twice instead would give another A2, of a method that is unstable
for stiff springs; between the ends of a step that quintic is good enough to find crossings.
"""

from __future__ import annotations

from math import comb

import numpy as np
from numpy.polynomial import Polynomial

STAGES = 4
NODES = 0.5 + 0.5 * np.polynomial.legendre.leggauss(STAGES)[0]


def _lagrange(i: int) -> Polynomial:
    others = np.delete(NODES, i)
    return Polynomial.fromroots(others) / np.prod(NODES[i] - others)


_BASIS = [_lagrange(i) for i in range(STAGES)]
_ONCE = [basis.integ(1) for basis in _BASIS]
_TWICE = [basis.integ(2) for basis in _BASIS]

# Values at the nodes (stage i, weight of a_j), and at the end of the step.
A1 = np.array([[polynomial(c) for polynomial in _ONCE] for c in NODES])
A2 = A1 @ A1
B1 = np.array([polynomial(1.0) for polynomial in _ONCE])
B2 = np.array([polynomial(1.0) for polynomial in _TWICE])
# Acceleration polynomial at the end of the step.
B0 = np.array([basis(1.0) for basis in _BASIS])

# Modulus of the eigenvalues of A1 that lie nearest to the real axis: time scale, in steps, of a pole
# of the method.
GAMMA = float(min(np.linalg.eigvals(A1), key=lambda value: abs(value.imag)).__abs__())

# Power coefficients 1, s, .. of x(s) from the rows x_0, h v_0, h^2 a_1, .. h^2 a_4.
DEGREE = STAGES + 1
POWER = np.zeros((DEGREE + 1, DEGREE + 1))
POWER[0, 0] = POWER[1, 1] = 1.0
for _j, _polynomial in enumerate(_TWICE):
    POWER[: len(_polynomial.coef), 2 + _j] = _polynomial.coef

# The same polynomial in the Bernstein basis, whose coefficients enclose its values on [0, 1].
_BERNSTEIN_FROM_POWER = np.array(
    [[comb(i, k) / comb(DEGREE, k) for k in range(DEGREE + 1)] for i in range(DEGREE + 1)]
)
BERNSTEIN = _BERNSTEIN_FROM_POWER @ POWER


# Power coefficients in s of the acceleration from its values at the nodes.
_POWERS = np.arange(STAGES)
_FROM_NODES = np.linalg.inv(NODES[:, None] ** _POWERS)


def interpolation(start: float, ratio: float) -> np.ndarray:
    """Return the weights of a step's stage accelerations for those at other nodes, (4, 4).

    Args:
        start: Start of the other nodes' step, in lengths of the step: 1 for the following one.
        ratio: Length of the other step over that of the step.
    """
    weights: np.ndarray = ((start + ratio * NODES)[:, None] ** _POWERS).dot(_FROM_NODES)
    return weights
