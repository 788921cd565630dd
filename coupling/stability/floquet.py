"""Growth of a vibration in a cut: Floquet multipliers by spectral elements.

Structure and cut are a periodic equation with delay [Insperger2004], [Bayly2003]. What the tool does
while teeth are in the cut is a polynomial between the corners of the cut, through Gauss points; the
modes answer to it exactly, so that only as many points are needed as its waves have. The operator from
one period to the next is then a matrix, whose largest eigenvalue mu tells the growth ln|mu| / T.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import Literal

import numpy as np
from scipy.sparse.linalg import ArpackError, eigs

from coupling.stability.period_elements import PeriodElement, period_elements
from coupling.stability.steady_cut import SteadyCut
from coupling.stability.structure import WRENCH, Structure

# A multiplier is real up to rounding; one below zero is a flip's (period doubling).
_REAL = 1e-12
# Growth that is none: of what stays where it is, such as a gear inside its backlash [1/s].
NEUTRAL = 1e-6
# Of larger operators so many of the largest multipliers are computed, and not all.
_LARGE, _LARGEST = 150, 6
# Harmonics of the cut beyond the fastest mode that may be the strongest part of a vibration.
_HARMONICS = 60

Border = Literal["Hopf", "flip", "none"]


@dataclass(frozen=True)
class Vibration:
    """The vibration that decays slowest, or grows fastest, in a cut.

    Attributes:
        growth: Exponent of its growth [1/s]; negative where it decays.
        border: "flip" where it changes sign from period to period, "none" where it keeps it, and else
            "Hopf".
        frequency: Frequency of its strongest part [Hz].
        force: Wrench of the cut in that part [N, N m], axes of the cut, complex, (6,); its size means
            nothing.
    """

    growth: float
    border: Border
    frequency: float
    force: np.ndarray

    @property
    def is_stable(self) -> bool:
        """Whether it decays."""
        return self.growth < NEUTRAL


def growth_of(structure: Structure, cut: SteadyCut) -> float:
    """Return the growth of the vibration that decays slowest [1/s].

    Example:
        >>> from coupling.stability.structure import ToolMode
        >>> from coupling.process.cutting_force import Cutter, CuttingCoefficients
        >>> tip = Structure.of_modes([ToolMode(922.0, 0.011, 1.34e6)])
        >>> mill = Cutter(radius=8e-3, teeth=2, helix=0.0, speed=5000.0 * np.pi / 30.0)
        >>> slot = SteadyCut(mill, CuttingCoefficients(6e8, 2e8, 0, 0, 0, 0), 0.0, np.pi, 2e-5)
        >>> growth_of(tip, slot) < 0.0, growth_of(tip, slot.at_depth(2e-3)) > 0.0
        (True, True)
    """
    operator = PeriodOperator.of(structure, cut)
    return operator.growth(operator.multipliers)


def vibration_of(structure: Structure, cut: SteadyCut) -> Vibration:
    """Return the vibration that decays slowest, with its frequency and its force."""
    return PeriodOperator.of(structure, cut).vibration()


class PeriodOperator:
    """The matrix from one period of a cut to the next, and what it tells.

    The state is that of the modes at a period's beginning and the tool's motion at all points within it.

    Args:
        structure: Modes of robot and tool.
        cut: The cut.
        elements: Parts of its period.
    """

    def __init__(
        self, structure: Structure, cut: SteadyCut, elements: Sequence[PeriodElement]
    ) -> None:
        self._structure, self._cut, self._elements = structure, cut, elements
        self._count = sum(len(element.rule.points) for element in elements)

    @classmethod
    def of(cls, structure: Structure, cut: SteadyCut, refined: float = 1.0) -> PeriodOperator:
        """Return the operator of a cut.

        Args:
            structure: Modes of robot and tool.
            refined: Factor of the number of points.

        Raises:
            StabilityError: If the cut is too slow for the fastest mode.
        """
        return cls(structure, cut, period_elements(structure, cut, refined))

    @cached_property
    def _gains(self) -> list[np.ndarray]:
        """Modal participation of what the tool does at the points of each element, (p, 2, k)."""
        return [
            (self._structure.driving @ self._cut.gain(element.channel, element.time)).transpose(
                0, 2, 1
            )
            for element in self._elements
        ]

    def _rows(self, time: np.ndarray, is_rate: bool) -> tuple[np.ndarray, np.ndarray]:
        """Return the tool's motion at times by the state of the modes and by its motion at all points.

        Args:
            time: Times within a period [s], (n,).
            is_rate: Whether its velocity is meant.

        Returns:
            (2 n, states) and (2 n, 2 points).
        """
        structure = self._structure
        rate = structure.eigenvalue
        output = structure.displacement * (rate if is_rate else 1.0)
        by_state = output[None] * np.exp(time[:, None] * rate)[:, None]
        by_motion = np.zeros((len(time), 2, self._count, 2))
        for element, gain in zip(self._elements, self._gains, strict=True):
            within = self._integrals(element, time)
            points = slice(element.first, element.first + len(element.rule.points))
            # Points, times and axes, modes; times points, modes, axes.
            shown = within.transpose(1, 0, 2)[:, :, None] * output
            product = shown.reshape(len(shown), -1, len(rate)) @ gain.transpose(0, 2, 1)
            motion = product.real.reshape(len(shown), len(time), 2, 2)
            by_motion[:, :, points] = motion.transpose(1, 2, 0, 3)
        return (
            self._real(by_state).reshape(2 * len(time), -1),
            by_motion.reshape(2 * len(time), -1),
        )

    def _integrals(self, element: PeriodElement, time: np.ndarray) -> np.ndarray:
        """Return the answers of the modes at times to the polynomials of an element, (n, p, k)."""
        rate, rule = self._structure.eigenvalue, element.rule
        answer = np.zeros((len(time), len(rule.points), len(rate)), dtype=complex)
        if time is element.time:
            return element.length * rule.within(rate * element.length)
        place = (time - element.begin) / element.length
        inside = np.flatnonzero((place > 0.0) & (place < 1.0))
        if len(inside):
            answer[inside] = rule.partial(rate * element.length, place[inside])
        behind = np.flatnonzero(place >= 1.0)
        if len(behind):
            later = time[behind] - element.begin - element.length
            whole = rule.whole(rate * element.length)
            answer[behind] = np.exp(later[:, None] * rate)[:, None] * whole
        return element.length * answer

    def _real(self, by_mode: np.ndarray) -> np.ndarray:
        """Return real columns by real and imaginary parts of the modes' states, (.., states)."""
        pair = self._structure.is_pair
        return np.concatenate([by_mode.real, -by_mode.imag[..., pair]], axis=-1)

    @cached_property
    def matrix(self) -> np.ndarray:
        """The operator, a matrix of states and motions, (states + 2 points, states + 2 points)."""
        structure, period = self._structure, self._cut.period
        rate, pair = structure.eigenvalue, structure.is_pair
        # The modes' states at the period's end.
        turn = np.exp(rate * period)
        by_point = np.zeros((len(rate), self._count, 2), dtype=complex)
        for element, gain in zip(self._elements, self._gains, strict=True):
            points = slice(element.first, element.first + len(element.rule.points))
            whole = self._integrals(element, np.array([period]))[0]
            by_point[:, points] = np.einsum("pk,pck->kpc", whole, gain)
        ends = by_point.reshape(len(rate), -1)
        by_end = np.vstack([ends.real, ends.imag[pair]])
        states = len(rate) + int(pair.sum())
        advance = np.zeros((states, states))
        advance[: len(rate)] = self._real(np.diag(turn))
        advance[len(rate) :] = self._real(-1j * np.diag(turn)[pair])
        # The tool's motion now, less what it was a delay ago.
        now = [np.zeros((0, states)), np.zeros((0, 2 * self._count))]
        before = [np.zeros((0, states)), np.zeros((0, 2 * self._count))]
        for element in self._elements:
            parts = self._of_element(element)
            now = [np.vstack(joined) for joined in zip(now, parts[:2], strict=True)]
            before = [np.vstack(joined) for joined in zip(before, parts[2:], strict=True)]
        # v is now_z z + now_v v + before_z z' + before_v v', and z is advance z' + by_end v'.
        implicit = np.eye(2 * self._count) - now[1]
        explicit = np.hstack([now[0] @ advance + before[0], now[0] @ by_end + before[1]])
        return np.vstack([np.hstack([advance, by_end]), np.linalg.solve(implicit, explicit)])

    def _of_element(
        self, element: PeriodElement
    ) -> tuple[np.ndarray, np.ndarray, np.ndarray, np.ndarray]:
        """Return what its points' motion is of: state and motion now, state and motion before."""
        delay, time = element.channel.delay, element.time
        by_state, by_motion = self._rows(time, delay is None)
        if delay is None:
            return by_state, by_motion, np.zeros_like(by_state), np.zeros_like(by_motion)
        if delay == self._cut.period:
            return by_state, by_motion, -by_state, -by_motion
        earlier = time - delay
        is_now = np.repeat(earlier >= 0.0, 2)[:, None].astype(float)
        state, motion = self._rows(earlier % self._cut.period, False)
        return (
            by_state - is_now * state,
            by_motion - is_now * motion,
            (is_now - 1.0) * state,
            (is_now - 1.0) * motion,
        )

    @cached_property
    def multipliers(self) -> np.ndarray:
        """Floquet multipliers [1], complex, (n,): all, or of a large operator the largest."""
        if len(self.matrix) > _LARGE:
            return self._largest[0]
        return np.linalg.eigvals(self.matrix)

    @cached_property
    def _largest(self) -> tuple[np.ndarray, np.ndarray]:
        """Multipliers, (n,), and their vectors, (states + 2 points, n), the largest among them."""
        size = len(self.matrix)
        if size > _LARGE:
            try:
                # A first vector that is always the same, and normal to none.
                first = np.cos(np.arange(size) ** 2)
                return eigs(self.matrix, k=_LARGEST, v0=first)
            except ArpackError:  # it does not converge
                pass
        return np.linalg.eig(self.matrix)

    def growth(self, multipliers: np.ndarray) -> float:
        """Return the growth of the largest of multipliers, (n,), [1/s]."""
        return float(np.log(np.abs(multipliers).max()) / self._cut.period)

    def vibration(self) -> Vibration:
        """Return the vibration of the largest multiplier."""
        if not self._elements:
            return self._free()
        values, vectors = self._largest
        largest = int(np.argmax(np.abs(values)))
        multiplier = values[largest]
        if multiplier.imag < 0.0:
            largest = int(np.argmin(np.abs(values - multiplier.conj())))
            multiplier = values[largest]
        period, states = self._cut.period, len(vectors) - 2 * self._count
        exponent = np.log(multiplier) / period
        farthest = _HARMONICS + int(self._structure.fastest * period / (2.0 * np.pi))
        harmonic = exponent + 2j * np.pi * np.arange(-farthest, farthest + 1) / period
        motion = vectors[states:, largest].reshape(-1, 2)
        force = np.zeros((len(harmonic), 6), dtype=complex)
        for element in self._elements:
            points = motion[element.first : element.first + len(element.rule.points)]
            gain = self._cut.gain(element.channel, element.time)
            wave = np.exp(-harmonic[:, None] * element.time) * element.rule.weights
            force += element.length * np.einsum("hp,pwc,pc->hw", wave, gain, points)
        answer = self._structure.answer(harmonic, np.eye(WRENCH))
        displacement = np.einsum("hcw,hw->hc", answer, force)
        strongest = int(np.argmax(np.linalg.norm(displacement, axis=1)))
        is_real = abs(multiplier.imag) <= _REAL * abs(multiplier)
        border: Border = "Hopf" if not is_real else "flip" if multiplier.real < 0.0 else "none"
        return Vibration(
            self.growth(values),
            border,
            abs(float(harmonic[strongest].imag)) / (2.0 * np.pi),
            force[strongest],
        )

    def _free(self) -> Vibration:
        """Return the mode that decays slowest, as no tooth is in the cut."""
        slowest = int(np.argmax(self._structure.eigenvalue.real))
        rate = self._structure.eigenvalue[slowest]
        border: Border = "Hopf" if rate.imag > 0.0 else "none"
        frequency = float(rate.imag) / (2.0 * np.pi)
        return Vibration(float(rate.real), border, frequency, np.zeros(6, dtype=complex))
