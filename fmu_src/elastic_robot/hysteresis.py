"""Hysteresis of the gears: their elements, what these carry and how they follow a motion.

Element j of a gear with wind-up e = x[k] has an elongation s_j, which takes every change of e until it
reaches the slip angle a_j, and a torque in proportion to it (Prandtl's stop operator, [Brokate1996] in
docs/references.md):

    s_j = clip(s_j + de, +-a_j)        along a monotone change de of e
    H_k = F_k sum_j p_j s_j / a_j      beside the torque curve S_k(e)

with the torque F_k at which all elements of the gear slip, and the shares p_j of it, sum p_j = 1.  An
element sticks while s' = e', and slips while s' = 0.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np

from elastic_robot.description import Robot

# A rate times this [s] is how far a slipping element is from its reversal [rad], as a sticking one is
# some way from its slip angle.
REVERSAL_TIME = 1e-3


@dataclass(frozen=True)
class Elements:
    """Elements of all gears, e of them, in the order of the gears.

    Attributes:
        coordinate: Index of the gear's wind-up among the elastic coordinates, rising, (e,).
        number: Number of the element within its gear, from 1, (e,).
        slip_angle: Elongation a at which it slips [rad], > 0, (e,).
        share: Its share p of the gear's slip torque, (e,).
    """

    coordinate: np.ndarray
    number: np.ndarray
    slip_angle: np.ndarray
    share: np.ndarray

    @classmethod
    def of(cls, robot: Robot) -> Elements:
        """Return the elements of a robot's description."""
        rows: list[tuple[int, int, float, float]] = []
        coordinate = 0
        for joint in robot.joints:
            torque = sum(stop.slip_torque for stop in joint.hysteresis)
            for number, stop in enumerate(joint.hysteresis, start=1):
                rows.append((coordinate, number, stop.slip_angle, stop.slip_torque / torque))
            coordinate += (joint.stiffness is not None) + len(joint.tilt)
        index, slips = np.array([row[:2] for row in rows], dtype=int), [row[2:] for row in rows]
        return cls(*index.reshape(-1, 2).T, *np.array(slips, dtype=float).reshape(-1, 2).T)

    @property
    def places(self) -> list[tuple[int, int]]:
        """Coordinate and number of each element."""
        return list(zip(self.coordinate.tolist(), self.number.tolist(), strict=True))

    @property
    def gears(self) -> np.ndarray:
        """Indices of the elastic coordinates that have elements, rising, (g,)."""
        return np.unique(self.coordinate)

    @property
    def count(self) -> int:
        """Number of elements e."""
        return len(self.coordinate)


@dataclass(frozen=True)
class HeldHysteresis:
    """What the elements add to the equation of motion at a state, each sticking or slipping as it does.

    Attributes:
        torque: H [N m], (m,) or of k states (k, m), or 0.
        slope: dH/dx of those that stick [N m/rad], (m,) or (k, m), or 0.
        gradient: dH/dF at fixed elongations [1], (m,) or (k, m), or 0.
    """

    torque: np.ndarray
    slope: np.ndarray
    gradient: np.ndarray


NO_HYSTERESIS = HeldHysteresis(*np.zeros(3))


@dataclass(frozen=True)
class Hysteresis:
    """Law of the elements; elongations are (e,) or of k states (k, e).

    Attributes:
        elements: The elements.
        slip_torque: Torque F of each elastic coordinate at which all its elements slip [N m], (m,).

    Example:
        >>> one = np.array([1])
        >>> two_slip = Elements(0 * one.repeat(2), np.array([1, 2]), np.array([2e-5, 6e-5]), one / 2)
        >>> gear = Hysteresis(two_slip, np.array([40.0]))
        >>> s = gear.elongation_after(np.zeros(2), np.array([3e-5]))
        >>> s, gear.torque(s)
        (array([2.e-05, 3.e-05]), array([30.]))
    """

    elements: Elements
    slip_torque: np.ndarray

    @cached_property
    def stiffness(self) -> np.ndarray:
        """Stiffness of each element while it sticks, F p / a [N m/rad], (e,)."""
        return self.slip_torque[self.elements.coordinate] * self._compliant

    @cached_property
    def acts(self) -> bool:
        """Whether any element has a torque."""
        return bool(self.stiffness.any())

    def torque(self, elongation: np.ndarray) -> np.ndarray:
        """H [N m], (m,) or (k, m)."""
        return (elongation * self.stiffness) @ self._gear

    def gradient(self, elongation: np.ndarray) -> np.ndarray:
        """dH/dF at fixed elongations, sum p s / a [1], (m,) or (k, m)."""
        return (elongation * self._compliant) @ self._gear

    def slope(self, sticks: np.ndarray) -> np.ndarray:
        """dH/dx of the elements that stick, a mask (e,) [N m/rad], (m,)."""
        return (self.stiffness * sticks) @ self._gear

    def sticks(self, elongation: np.ndarray, rate: np.ndarray) -> np.ndarray:
        """Return the mask of elements that stick, (e,); at rest one at its slip angle slips.

        Args:
            elongation: s [rad], (e,).
            rate: Rates of the elastic coordinates [rad/s], (m,).
        """
        away = elongation * rate[self.elements.coordinate] < 0.0
        return away | (np.abs(elongation) < self.elements.slip_angle)

    def rate(self, elongation: np.ndarray, rate: np.ndarray) -> np.ndarray:
        """Return s' [rad/s], (e,); arguments as of `sticks`."""
        return self.sticks(elongation, rate) * rate[self.elements.coordinate]

    def ways(self, elongation: np.ndarray, rate: np.ndarray) -> np.ndarray:
        """How far each element is from sticking or slipping instead [rad], (e,); as of `sticks`.

        A sticking one has a - |s| to its slip angle; one that slips has its rate times `REVERSAL_TIME`.
        """
        slipping = np.abs(rate[self.elements.coordinate]) * REVERSAL_TIME
        sticking = self.elements.slip_angle - np.abs(elongation)
        return np.where(self.sticks(elongation, rate), sticking, slipping)

    def elongation_after(self, elongation: np.ndarray, change: np.ndarray) -> np.ndarray:
        """Return the elongations [rad], (e,), after a monotone change of x [rad], (m,)."""
        limit = self.elements.slip_angle
        return np.clip(elongation + change[self.elements.coordinate], -limit, limit)

    def at_state(self, elongation: np.ndarray, rate: np.ndarray) -> HeldHysteresis:
        """Return what the elements add where s [rad] is (e,) and the rates [rad/s] of x are (m,)."""
        slope = self.slope(self.sticks(elongation, rate))
        return HeldHysteresis(self.torque(elongation), slope, self.gradient(elongation))

    @cached_property
    def _compliant(self) -> np.ndarray:
        return self.elements.share / self.elements.slip_angle

    @cached_property
    def _gear(self) -> np.ndarray:
        """Matrix that sums over the elements of each coordinate, (e, m)."""
        return np.equal.outer(self.elements.coordinate, np.arange(len(self.slip_torque))).astype(
            float
        )


@dataclass(frozen=True)
class Past:
    """Where the gears come from: each goes monotonously from there to where it rests.

    So what its elements carry is a law of x, rising, and has an energy.

    Attributes:
        hysteresis: Law of the elements.
        x: Elastic coordinates that they come from [rad], (m,).
        elongation: Elongations there [rad], (e,).
    """

    hysteresis: Hysteresis
    x: np.ndarray
    elongation: np.ndarray

    @classmethod
    def start(cls, hysteresis: Hysteresis, slipped: int = 0) -> Past:
        """Return that of a robot which has not been loaded before.

        Args:
            hysteresis: Law of the elements.
            slipped: 1: it comes from far below, so that all elements slip upwards; -1: from above.
        """
        x = np.full(len(hysteresis.slip_torque), -slipped * np.inf if slipped else 0.0)
        return cls(hysteresis, x, np.zeros(hysteresis.elements.count))

    @property
    def acts(self) -> bool:
        """Whether any element has a torque."""
        return self.hysteresis.acts

    def elongation_at(self, x: np.ndarray) -> np.ndarray:
        """Return s [rad], (e,), of gears that have gone to x [rad], (m,)."""
        return self.hysteresis.elongation_after(self.elongation, x - self.x)

    def torque(self, x: np.ndarray) -> np.ndarray:
        """H [N m], (m,), of gears that have gone to x [rad], (m,)."""
        return self.hysteresis.torque(self.elongation_at(x)) if self.acts else np.zeros(len(x))

    def energy(self, x: np.ndarray) -> float:
        """Return what elements hold and slip takes up to x [rad], (m,): an energy [J] of any zero."""
        if not self.acts:
            return 0.0
        of = self.hysteresis.elements
        s, limit = self.elongation + (x - self.x)[of.coordinate], of.slip_angle
        slid = limit * (np.abs(s) - 0.5 * limit)
        # From far away an element has slipped all along: its torque is the same.
        slid = np.where(np.isfinite(s), slid, np.sign(s) * limit * x[of.coordinate])
        stuck = np.abs(s) < limit
        return float(self.hysteresis.stiffness @ np.where(stuck, 0.5 * s * s, slid))

    def slope(self, x: np.ndarray) -> np.ndarray:
        """dH/dx [N m/rad], (m,)."""
        if not self.acts:
            return np.zeros(len(x))
        sticks = np.abs(self.elongation_at(x)) < self.hysteresis.elements.slip_angle
        return self.hysteresis.slope(sticks)
