"""The quick look: limits with the mean of the directional factors (zero order) [Altintas1995].

A vibration exp(i omega t) stays as it is where 1 = b mu(omega) (1 - exp(-i omega tau)), mu an eigenvalue
of the compliance times the mean gain by depth. With 1 - exp(-i theta) = 1 / (1/2 - i/2 cot(theta/2)):

    1/b = 2 Re(mu),    cot(theta/2) = -Im(mu) / Re(mu),    omega tau = theta + 2 pi k

It is wrong at low immersion, where a vibration flips from tooth to tooth, and where speeds are so low
that the factors change within a wave.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from coupling.stability.steady_cut import SteadyCut
from coupling.stability.structure import Structure

# Frequencies of the border: between these shares of the slowest and the fastest mode, and how many.
_BELOW, _ABOVE, _COUNT = 0.2, 12.0, 500
# Points about a mode, in its half widths.
_CLOSE = np.sinh(np.linspace(-4.5, 4.5, 41)) / 3.0
# Depth that stands for the part of the gain that is linear in it [m].
_SHALLOW = 1e-9
# Speeds of a range that are looked at.
_SPEEDS = 30


@dataclass(frozen=True)
class ZeroOrder:
    """Borders of stability over the frequency of the vibration, for all speeds of the spindle.

    Attributes:
        omega: Frequencies [rad/s], rising, (n,).
        inverse_depth: Value 1/b, not positive where there is no border [1/m], (n, 2).
        phase: Angle theta from one tooth to the next, between 0 and 2 pi [rad], (n, 2).
    """

    omega: np.ndarray
    inverse_depth: np.ndarray
    phase: np.ndarray

    @classmethod
    def of(cls, structure: Structure, cut: SteadyCut) -> ZeroOrder:
        """Return the borders of a cut, whose speed and depth do not count; pitch as if even."""
        shallow = cut.at_depth(_SHALLOW)
        gain = shallow.mean_gain / _SHALLOW
        omega = _frequencies(structure)
        a, b, c, d = structure.answer(1j * omega, gain).reshape(-1, 4).T
        middle, root = 0.5 * (a + d), np.sqrt(0.25 * (a - d) ** 2 + b * c)
        # Each of both goes on continuously.
        turns = np.real(root[1:] * root[:-1].conj()) < 0.0
        root[1:] *= np.where(np.cumsum(turns) % 2 == 1, -1.0, 1.0)
        eigenvalue = middle[:, None] + root[:, None] * [1.0, -1.0]
        phase = 2.0 * np.arctan2(eigenvalue.real, -eigenvalue.imag)
        # Where Re(mu) = 0 the depth is infinite and the phase 0 or a whole turn.
        return cls(omega, 2.0 * eigenvalue.real, phase)

    def least(self, cut: SteadyCut, low: float, high: float) -> float:
        """Return the depth [m] that no speed between two [1/min] falls below; infinite without one."""
        speeds = np.geomspace(low, high, _SPEEDS)
        return min(self.limit(cut.at_speed(speed).cutter.tooth_period) for speed in speeds.tolist())

    def limit(self, tooth_period: float) -> float:
        """Return the limiting depth [m] at a time between two teeth [s]; infinite without one."""
        begin, end = self.inverse_depth[:-1], self.inverse_depth[1:]
        is_border = np.maximum(begin, end) > 0.0
        # Ends of each interval in which 1/b > 0: where it crosses zero there is a node.
        slope = end - begin
        with np.errstate(divide="ignore", invalid="ignore"):
            crossing = np.where(slope != 0.0, -begin / slope, 0.0)
        first = np.where(begin > 0.0, 0.0, crossing)
        last = np.where(end > 0.0, 1.0, crossing)
        step = np.diff(self.omega)[:, None]
        low, high = self.omega[:-1, None] + first * step, self.omega[:-1, None] + last * step
        phase_low = np.where(begin > 0.0, self.phase[:-1], _at_node(self.phase[1:]))
        phase_high = np.where(end > 0.0, self.phase[1:], _at_node(self.phase[:-1]))
        value_low, value_high = np.maximum(begin, 0.0), np.maximum(end, 0.0)
        turns_low = (low * tooth_period - phase_low) / (2.0 * np.pi)
        turns_high = (high * tooth_period - phase_high) / (2.0 * np.pi)
        largest = 0.0
        # Of all whole turns between both ends 1/b is largest at the first or the last.
        least, most = np.minimum(turns_low, turns_high), np.maximum(turns_low, turns_high)
        for whole in (np.ceil(least), np.floor(most)):
            inside = is_border & (whole >= least) & (whole <= most) & (whole >= 0.0)
            width = np.where(turns_high != turns_low, turns_high - turns_low, 1.0)
            share = np.clip((whole - turns_low) / width, 0.0, 1.0)
            value = value_low + share * (value_high - value_low)
            largest = max(largest, float(np.max(value[inside], initial=0.0)))
        return 1.0 / largest if largest > 0.0 else np.inf


def _at_node(phase: np.ndarray) -> np.ndarray:
    """Return the phase where 1/b = 0 beside one where there is a border: 0 or a whole turn."""
    return np.where(phase < np.pi, 0.0, 2.0 * np.pi)


def _frequencies(structure: Structure) -> np.ndarray:
    """Return where the borders are looked at, closest at the modes [rad/s], (n,)."""
    omega = structure.eigenvalue.imag[structure.is_pair]
    width = -structure.eigenvalue.real[structure.is_pair]
    if len(omega) == 0:  # none swings: where they creep
        omega = np.abs(structure.eigenvalue)
        omega = omega[omega > 0.0]
        width = np.zeros_like(omega)
    if len(omega) == 0:
        return np.ones(1)
    wide = np.geomspace(_BELOW * omega.min(), _ABOVE * omega.max(), _COUNT)
    close = (omega[:, None] + np.abs(width)[:, None] * _CLOSE).ravel()
    return np.unique(np.concatenate([wide, close[close > 0.0]]))
