"""Whether a cut chatters: its growth, its frequency, its limiting depth, and what gives way."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from functools import cached_property, partial

import numpy as np

from coupling.stability.case_cut import CaseCuts, PlacedCut, StructureThere
from coupling.stability.floquet import Vibration, vibration_of
from coupling.stability.limit import first_border, stable_islands
from coupling.stability.period_elements import points_of
from coupling.stability.structure import Structure
from coupling.stability.zero_order import ZeroOrder

# Points of cuts among which a limit is looked for, at most.
_MOST_POINTS = 400

# Called with what is done, how much of it, and of how much.
Report = Callable[[str, int, int], None]


@dataclass(frozen=True)
class Judgement:
    """A cut at a place, judged.

    Attributes:
        cuts: The case's cuts.
        placed: The cut.
        there: Modes at that place.
    """

    cuts: CaseCuts
    placed: PlacedCut
    there: StructureThere

    @classmethod
    def of(cls, cuts: CaseCuts, placed: PlacedCut) -> Judgement:
        """Return the judgement of a cut.

        Raises:
            StabilityError: If the robot has no equilibrium there, or nothing gives way.
        """
        return cls(cuts, placed, cuts.structure(placed))

    @cached_property
    def vibration(self) -> Vibration:
        """The vibration that decays slowest at the programmed depth."""
        return vibration_of(self.there.whole, self.placed.cut)

    @property
    def is_stable(self) -> bool:
        """Whether it decays."""
        return self.vibration.is_stable

    @cached_property
    def deepest(self) -> float:
        """Depth up to which limits are looked for [m], that of the cut at least.

        Long edges take many points: where there are too many it is halved.
        """
        deepest, cut = self.cuts.deepest, self.placed.cut
        while deepest > cut.depth:
            if points_of(self.there.whole, cut.at_depth(deepest)) <= _MOST_POINTS:
                return deepest
            deepest *= 0.5
        return cut.depth

    @cached_property
    def limit(self) -> float:
        """Depth of the first border from below [m]; infinite where there is none."""
        return first_border(self.there.whole, self.placed.cut, self.deepest, self._quick)

    @cached_property
    def _quick(self) -> ZeroOrder:
        return ZeroOrder.of(self.there.whole, self.placed.cut)

    def islands(self, report: Report) -> list[tuple[float, float]]:
        """Return depths beyond the limit at which it is stable again, from and to [m]."""
        cut, limit = self.placed.cut, self.limit
        return stable_islands(
            self.there.whole, cut, limit, self.deepest, partial(report, "depths beyond the limit")
        )

    @property
    def zero_order(self) -> float:
        """The same by zero order [m]."""
        return self._quick.limit(self.placed.cut.cutter.tooth_period)

    @property
    def zero_order_margin(self) -> float:
        """The same over the programmed depth [1]."""
        return self.zero_order / self.placed.cut.depth

    @property
    def least(self) -> float:
        """Depth that no speed of the spindle's range falls below, by zero order [m]."""
        return self._quick.least(self.placed.cut, *self.cuts.speeds)

    @cached_property
    def at_limit(self) -> Vibration:
        """The vibration at the limiting depth; where there is none, at the programmed one."""
        if not np.isfinite(self.limit):
            return self.vibration
        return vibration_of(self.there.whole, self.placed.cut.at_depth(self.limit))

    @property
    def displacement(self) -> float:
        """Displacement of the TCP by the cut's mean force, the tool rigid [m]."""
        return float(np.linalg.norm(self._mean_displacement))

    @cached_property
    def _mean_displacement(self) -> np.ndarray:
        """The same as a vector, base axes, (3,)."""
        compliance = self.there.linear.dynamic_compliance(np.zeros(1))[0, :3].real
        displacement: np.ndarray = compliance @ self.cuts.mean_wrench(self.placed)
        return displacement

    @property
    def chatters_clearly(self) -> bool:
        """Whether it chatters as deep as programmed, and where the mean force lifts the tool."""
        cut, spindle = self.placed.cut, self.cuts.base_from_part[:, 2]
        depth = cut.depth - max(float(spindle @ self._mean_displacement), 0.0)
        if self.is_stable or depth <= 0.0:
            return False
        return (
            depth == cut.depth or not vibration_of(self.there.whole, cut.at_depth(depth)).is_stable
        )

    @property
    def margin(self) -> float:
        """Limit over the programmed depth [1]; below 1 where it chatters, unless in an island."""
        return self.limit / self.placed.cut.depth

    def shares(self, vibration: Vibration) -> tuple[np.ndarray, float]:
        """Return the joints' shares in a vibration's elastic energy, and the tool's in its motion.

        Args:
            vibration: A vibration of this cut.

        Returns:
            Shares of the joints [1], (joints,), and of the tool [1].
        """
        exponent = np.array([vibration.growth + 2j * np.pi * vibration.frequency])
        linear, joints = self.there.linear, len(self.placed.q)
        force = vibration.force
        by_robot = self._size_of_motion(self.there.robot, exponent, force)
        both = by_robot + sum(
            self._size_of_motion(Structure.of_modes([mode]), exponent, force)
            for mode in self.cuts.tool
        )
        share = float(np.clip(1.0 - by_robot / both, 0.0, 1.0)) if both > 0.0 else 0.0
        if len(linear.mass) == 0:
            return np.zeros(joints), share
        turn = np.kron(np.eye(2), self.cuts.base_from_cut(self.placed.feed))
        s = exponent[0]
        impedance = linear.stiffness + s * linear.damping + s**2 * linear.mass
        elastic = np.linalg.solve(impedance, linear.forcing[:, :6] @ turn @ force)
        energy = np.abs(np.diag(linear.stiffness)) * np.abs(elastic) ** 2
        by_joint = np.zeros(joints)
        np.add.at(by_joint, np.array(self.cuts.joints, dtype=int) - 1, energy)
        total = by_joint.sum()
        return (by_joint / total if total > 0.0 else by_joint), share

    @staticmethod
    def _size_of_motion(structure: Structure, exponent: np.ndarray, force: np.ndarray) -> float:
        """Return how far a force moves the tip of a structure [m]."""
        return float(np.linalg.norm(structure.answer(exponent, force[:, None])))


def in_words(judgement: Judgement) -> str:
    """Return "stable, limit x mm at n" or "chatters at f Hz from depth x"."""
    cut, limit = judgement.placed.cut, judgement.limit
    at = f"at {cut.rpm:.0f} 1/min"
    if judgement.is_stable:
        if not np.isfinite(limit):
            return f"stable, no limit up to {1e3 * judgement.deepest:.3g} mm {at}"
        if limit < cut.depth:
            return (
                f"stable at {1e3 * cut.depth:.3g} mm {at}, but chatters at depths from"
                f" {1e3 * limit:.3g} mm below it"
            )
        return f"stable, limit {1e3 * limit:.3g} mm {at}"
    frequency = judgement.vibration.frequency
    return f"chatters at {frequency:.1f} Hz from depth {1e3 * limit:.3g} mm {at}"
