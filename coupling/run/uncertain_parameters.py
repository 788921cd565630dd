"""Uncertain parameters of robots and load, the robots that their values make, and designs of samples."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from coupling.case.case import Case, PlacedRobot
from coupling.case.plant import CUT_OFF, Distribution, StudyTable
from coupling.robot.differences import AS_THE_MODEL, RobotDifference
from coupling.robot.parameter_table import VARIED
from coupling.run.sobol import sobol

# Names of the differences of robots, which may be one for each joint, by their keys.
_VARIED = {variation.key: name for name, (_, variation) in VARIED.items()}
_STIFFNESS = VARIED["stiffness"][1].key

# Lowest and highest stiffness by the number of the joint, from 1 [N m/rad].
StiffnessRanges = Mapping[int, tuple[float, float]]


@dataclass(frozen=True)
class LogUniform:
    """Distribution whose logarithm is uniform from low to high, both > 0."""

    low: float
    high: float


@dataclass(frozen=True)
class UncertainParameter:
    """An uncertain parameter.

    Attributes:
        name: Its key in [study]; with a joint's number in brackets where each joint has its own, and the
            robot's name before it where there are two robots.

    Example:
        >>> UncertainParameter("stiffness_factor[1]", LogUniform(0.5, 2.0)).at(np.array([0.0, 0.5, 1.0]))
        array([0.5, 1. , 2. ])
    """

    name: str
    spread: Distribution | LogUniform

    @property
    def range(self) -> tuple[float, float]:
        """Lowest and highest value."""
        low, high = self.at(np.array([0.0, 1.0]))
        return float(low), float(high)

    def at(self, share: np.ndarray) -> np.ndarray:
        """Return the values that are not exceeded with given probabilities, any shape."""
        spread = self.spread
        if isinstance(spread, LogUniform):
            return spread.low * (spread.high / spread.low) ** share
        if spread.low is not None and spread.high is not None:
            return spread.low + (spread.high - spread.low) * share
        from scipy.stats import truncnorm

        normal = truncnorm(-CUT_OFF, CUT_OFF, loc=spread.mean, scale=spread.deviation)
        return normal.ppf(share)

    def in_words(self) -> str:
        """Return its distribution, for people."""
        spread = self.spread
        if isinstance(spread, LogUniform):
            return f"uniform in its logarithm, {spread.low:.4g} to {spread.high:.4g}"
        if spread.low is not None:
            return f"uniform, {spread.low:g} to {spread.high:g}"
        return f"normal, mean {spread.mean:g}, deviation {spread.deviation:g}"


@dataclass(frozen=True)
class SampledRobots:
    """Robots and a load that a sample's values make."""

    differences: tuple[RobotDifference, ...]
    force: float

    @classmethod
    def as_the_model(cls, count: int) -> SampledRobots:
        """Return so many robots that do not differ."""
        return cls((AS_THE_MODEL,) * count, 1.0)


@dataclass(frozen=True)
class UncertainParameters:
    """Uncertain parameters of the robots of a case, and of its force.

    Attributes:
        payload_position: Place of an uncertain payload in the last body's frame of the first robot [m],
            (3,); None: at its TCP.
        silent: Keys that are not among the entries, as they change nothing in this case.
    """

    entries: tuple[UncertainParameter, ...]
    robots: tuple[str, ...]
    joints: tuple[int, ...]
    payload_position: tuple[float, ...] | None = None
    silent: tuple[str, ...] = ()

    @classmethod
    def expected(
        cls,
        robots: Sequence[PlacedRobot],
        ranges: Sequence[StiffnessRanges],
        force_factors: tuple[float, float] | None,
    ) -> UncertainParameters:
        """Return those of robots of which no more is known than ranges, of each gear independently.

        Args:
            ranges: Stiffness of their gears [N m/rad].
            force_factors: Lowest and highest real force over the process's; None: as the process's.
        """
        entries = [
            UncertainParameter(
                f"{_who(robot.name, len(robots))}{_STIFFNESS}[{number}]",
                LogUniform(low / stiffness, high / stiffness),
            )
            for robot, limits in zip(robots, ranges, strict=True)
            for number, (low, high) in sorted(limits.items())
            if (stiffness := robot.description.joints[number - 1].stiffness) is not None
        ]
        if force_factors is not None:
            low, high = force_factors
            entries.append(UncertainParameter("force_factor", Distribution(low=low, high=high)))
        return cls._of(entries, robots)

    @classmethod
    def _of(
        cls,
        entries: Sequence[UncertainParameter],
        robots: Sequence[PlacedRobot],
        payload_position: tuple[float, ...] | None = None,
        silent: Sequence[str] = (),
    ) -> UncertainParameters:
        return cls(
            tuple(entries),
            tuple(robot.name for robot in robots),
            tuple(len(robot.description.joints) for robot in robots),
            payload_position,
            tuple(silent),
        )

    @classmethod
    def chosen(cls, case: Case, loaded: bool) -> UncertainParameters:
        """Return those that a case varies on purpose.

        Args:
            loaded: Whether its command works against any wrench.
        """
        table = case.study
        entries: list[UncertainParameter] = []
        silent = []
        for key, spread in table.spreads().items():
            names = _names(key, table, case, loaded)
            if not names:
                silent.append(key)
            entries += [UncertainParameter(name, spread) for name in names]
        place = table.payload_position_m
        return cls._of(entries, case.robots, None if place is None else tuple(place), silent)

    @property
    def names(self) -> tuple[str, ...]:
        """Names of the entries."""
        return tuple(entry.name for entry in self.entries)

    def at(self, shares: np.ndarray) -> np.ndarray:
        """Return the values that are not exceeded with given probabilities, (n, entries) each."""
        columns = [entry.at(shares[:, k]) for k, entry in enumerate(self.entries)]
        return np.column_stack(columns) if columns else np.empty((len(shares), 0))

    def sampled(self, values: Sequence[float]) -> SampledRobots:
        """Return the robots and the load of a sample."""
        by_name = dict(zip(self.names, values, strict=True))
        differences = []
        for number, (robot, joints) in enumerate(zip(self.robots, self.joints, strict=True)):
            amounts = {
                name: amount
                for name in VARIED
                if (amount := self._amounts(by_name, name, robot, joints)) is not None
            }
            payload = by_name.get("payload_kg", 0.0) if number == 0 else 0.0
            differences.append(RobotDifference(amounts, payload, self.payload_position))
        return SampledRobots(tuple(differences), by_name.get("force_factor", 1.0))

    def _amounts(
        self, by_name: Mapping[str, float], name: str, robot: str, joints: int
    ) -> tuple[float, ...] | None:
        """Return one factor or shift for all joints, or one for each; None where it is not sampled."""
        _, variation = VARIED[name]
        key, who = variation.key, _who(robot, len(self.robots))
        each = [f"{who}{key}[{i + 1}]" for i in range(joints)]
        if key in by_name:
            return (variation.unit * by_name[key],)
        if by_name.keys().isdisjoint(each):
            return None
        return tuple(
            variation.unit * by_name[entry] if entry in by_name else variation.neutral
            for entry in each
        )


def _who(robot: str, robots: int) -> str:
    return f"{robot} " if robots > 1 else ""


def _names(key: str, table: StudyTable, case: Case, loaded: bool) -> tuple[str, ...]:
    """Return the names of a key's parameters, none if they change nothing in a case."""
    if key not in _VARIED:
        return (key,) if key != "force_factor" or loaded else ()
    each = tuple(
        f"{_who(robot.name, len(case.robots))}{key}[{i + 1}]"
        for robot in case.robots
        for i in range(len(robot.description.joints))
        if _changes(robot, key, i)
    )
    return each if table.joints == "each" or not each else (key,)


def _changes(robot: PlacedRobot, key: str, joint: int) -> bool:
    """Return whether a factor, or a shift, at one joint changes a parameter of the robot."""
    _, variation = VARIED[_VARIED[key]]
    amounts = [variation.neutral] * len(robot.description.joints)
    amounts[joint] += 0.5
    difference = RobotDifference({variation.name: tuple(amounts)})
    return bool(difference.values(robot.description, robot.torque_curve, robot.drive))


def latin_hypercube(count: int, width: int, seed: int) -> np.ndarray:
    """Return a Latin hypercube: a point in each of `count` slices of every axis, (count, width).

    Another number of points is another design.
    """
    from scipy.stats import qmc

    return qmc.LatinHypercube(width, rng=seed).random(count)


DESIGNS = {"sobol": sobol, "latin-hypercube": latin_hypercube}
GROWS = ("sobol",)


def draw_samples(design: str, count: int, seed: int, parameters: UncertainParameters) -> np.ndarray:
    """Return the values of the parameters of a design's samples, in their units, (count, k)."""
    return parameters.at(DESIGNS[design](count, len(parameters.entries), seed))
