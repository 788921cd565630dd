"""Steps of d e' + S(e) = T(t) along one piece of the torque curve, T a cubic of time in each step.

With the slope J of S at some point of the step, e = e_0 + y and lambda = J / d,

    y' = -lambda y + g,   g = (T - S(e_0 + y) + J y) / d,
    y(s) = integral of exp(-lambda (s - u)) g(u) du from 0 to s,

which is exact for polynomials g.  Where S is a line, g = (T - S(e_0)) / d is one: any step length, any
time constant d / J.  Where S bends: `gear_bends`.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from scipy.signal import lfilter

from coupling.inverse.gear_pieces import Piece

# Coefficients of the last moment's series in z; beyond the 17th nothing is left for z < 1.
_SERIES = {
    n: [(-1.0) ** m * math.factorial(n - 1) / math.factorial(n + m) for m in range(17)]
    for n in (4, 5)
}


def decaying_moments(z: np.ndarray, count: int) -> np.ndarray:
    """Return the integrals of exp(-z (1 - u)) u^j du over 0 <= u <= 1, j < count, (..., count).

    j! phi_{j+1}(-z) of exponential integrators.  Forward recursion for z >= 1; below, where it loses
    digits, the series of the last one and backward recursion.

    Args:
        z: Step over time constant [1], >= 0, any shape.
        count: Number of moments.
    """
    small = z < 1.0
    if small.all():
        return _moments_by_series(z, count)
    if not small.any():
        return _moments_by_recursion(z, count)
    psi = np.empty((*z.shape, count))
    psi[small] = _moments_by_series(z[small], count)
    psi[~small] = _moments_by_recursion(z[~small], count)
    return psi


def _moments_by_series(z: np.ndarray, count: int) -> np.ndarray:
    psi = np.empty((*z.shape, count))
    series = _SERIES[count]
    last = np.full(z.shape, series[-1])
    for c in series[-2::-1]:
        last *= z
        last += c
    psi[..., -1] = last
    for j in range(count - 1, 0, -1):
        psi[..., j - 1] = (1.0 - z * psi[..., j]) / j
    return psi


def _moments_by_recursion(z: np.ndarray, count: int) -> np.ndarray:
    psi = np.empty((*z.shape, count))
    psi[..., 0] = -np.expm1(-z) / z
    for j in range(1, count):
        psi[..., j] = (1.0 - j * psi[..., j - 1]) / z
    return psi


def line_weights(slope: float, damping: float, length: float) -> tuple[float, ...]:
    """Return the angle by each of T's coefficients of 1, s, s^2, s^3 in a step along a line, (4,).

    `decaying_moments` of one z, times length^(j + 1) / d.
    """
    z = slope * length / damping
    psi = [0.0] * 4
    if z < 1.0:
        last = 0.0
        for c in reversed(_SERIES[4]):
            last = last * z + c
        psi[3] = last
        for j in (3, 2, 1):
            psi[j - 1] = (1.0 - z * psi[j]) / j
    else:
        psi[0] = -math.expm1(-z) / z
        for j in (1, 2, 3):
            psi[j] = (1.0 - j * psi[j - 1]) / z
    return tuple(w * length ** (j + 1) / damping for j, w in enumerate(psi))


@dataclass(frozen=True)
class Steps:
    """Steps one behind the other, each inside one interval between samples.

    Attributes:
        row: Number of each step's interval, (k,).
        offset: Time of each step's start behind that of its interval [s], (k,).
        length: Length of each step [s], >= 0, (k,).
        torque: Coefficients of 1, s, s^2, s^3 in the torque [N m], s from the step's start [s], (k, 4).
        last: Mask of steps that end at their interval's end, (k,).
    """

    row: np.ndarray
    offset: np.ndarray
    length: np.ndarray
    torque: np.ndarray
    last: np.ndarray

    def halved(self, chosen: np.ndarray) -> Steps:
        """Return the steps with those of a mask (k,) divided into halves."""
        copies = np.where(chosen, 2, 1)
        index = np.repeat(np.arange(len(copies)), copies)
        second = np.zeros(len(index), dtype=bool)
        second[np.cumsum(copies)[chosen] - 1] = True
        length = np.where(chosen, 0.5 * self.length, self.length)[index]
        shift = np.where(second, length, 0.0)
        last = self.last[index] & (second | ~chosen[index])
        return Steps(
            self.row[index],
            self.offset[index] + shift,
            length,
            shifted(self.torque[index], shift),
            last,
        )


def shifted(cubic: np.ndarray, shift: np.ndarray | float) -> np.ndarray:
    """Return the coefficients of 1, s, s^2, s^3, any unit, (..., 4), of cubics from `shift` on."""
    c0, c1, c2, c3 = (cubic[..., j] for j in range(4))
    s = shift
    out = np.empty_like(cubic)
    out[..., 0] = c0 + s * (c1 + s * (c2 + s * c3))
    out[..., 1] = c1 + s * (2.0 * c2 + 3.0 * s * c3)
    out[..., 2] = c2 + 3.0 * s * c3
    out[..., 3] = c3
    return out


def follow_line(piece: Piece, damping: float, start: float, steps: Steps) -> np.ndarray:
    """Return the angles at the ends of steps along a straight piece [rad], (k,); exact.

    All steps but the first have one length.
    """
    slope = piece.cubic[1]
    torque = steps.torque
    if slope > 0.0:
        zero = piece.origin - piece.cubic[0] / slope
    else:
        zero, torque = 0.0, torque - np.array([piece.cubic[0], 0.0, 0.0, 0.0])
    first, length = float(steps.length[0]), float(steps.length[-1])
    weights = line_weights(slope, damping, length)
    ends = torque @ np.array(weights)
    moved = sum(w * c for w, c in zip(line_weights(slope, damping, first), torque[0], strict=True))
    ends[0] = math.exp(-slope * first / damping) * (start - zero) + moved
    decay = math.exp(-slope * length / damping)
    ends[1:], _ = lfilter([1.0], [1.0, -decay], ends[1:], zi=[decay * ends[0]])
    return ends + zero
