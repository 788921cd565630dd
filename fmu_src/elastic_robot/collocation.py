"""Coefficients of the three-stage Gauss collocation method for second-order equations.

The accelerations a_i at the Gauss points c_i define a quadratic x''(s) in s = (t - t_0)/h; its
integrals give, for a step of length h from x_0, v_0,

    x(s) = x_0 + s h v_0 + h^2 sum_j A2_j(s) a_j,      v(s) = v_0 + h sum_j A1_j(s) a_j.

Order 6 at the step's end (Hairer, Lubich, Wanner 2006, sec. II.1; docs/references.md).
"""

from __future__ import annotations

from math import comb

import numpy as np
from numpy.polynomial import Polynomial

STAGES = 3
NODES = np.array([0.5 - np.sqrt(15.0) / 10.0, 0.5, 0.5 + np.sqrt(15.0) / 10.0])


def _lagrange(i: int) -> Polynomial:
    others = np.delete(NODES, i)
    return Polynomial.fromroots(others) / np.prod(NODES[i] - others)


_BASIS = [_lagrange(i) for i in range(STAGES)]
_ONCE = [basis.integ(1) for basis in _BASIS]
_TWICE = [basis.integ(2) for basis in _BASIS]

# Values at the nodes (stage i, weight of a_j), and at the end of the step.
A1 = np.array([[polynomial(c) for polynomial in _ONCE] for c in NODES])
A2 = np.array([[polynomial(c) for polynomial in _TWICE] for c in NODES])
B1 = np.array([polynomial(1.0) for polynomial in _ONCE])
B2 = np.array([polynomial(1.0) for polynomial in _TWICE])
# Acceleration polynomial at the end of the step.
B0 = np.array([basis(1.0) for basis in _BASIS])

# Real eigenvalue of A1: time scale, in steps, of the real pole of the method.
GAMMA = float(next(value.real for value in np.linalg.eigvals(A1) if abs(value.imag) < 1e-12))

# Power coefficients 1, s, .. s^4 of x(s) from the rows x_0, h v_0, h^2 a_1, h^2 a_2, h^2 a_3.
POWER = np.zeros((5, 5))
POWER[0, 0] = POWER[1, 1] = 1.0
for _j, _polynomial in enumerate(_TWICE):
    POWER[: len(_polynomial.coef), 2 + _j] = _polynomial.coef

# The same polynomial in the Bernstein basis, whose coefficients enclose its values on [0, 1].
_BERNSTEIN_FROM_POWER = np.array([[comb(i, k) / comb(4, k) for k in range(5)] for i in range(5)])
BERNSTEIN = _BERNSTEIN_FROM_POWER @ POWER

# Quadratic through the stage accelerations: its power coefficients in s.
QUADRATIC = np.linalg.inv(np.vander(NODES, STAGES, increasing=True))


def extrapolate(acceleration: np.ndarray, ratio: float) -> np.ndarray:
    """Return the last step's acceleration polynomial at the nodes of the next step.

    Args:
        acceleration: Power coefficients in s of the last step, (3, m).
        ratio: Length of the next step over that of the last.
    """
    return np.vander(1.0 + ratio * NODES, STAGES, increasing=True) @ acceleration
