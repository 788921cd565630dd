"""Parameters that a motion may identify, by the term of the equations that they belong to."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Mapping
from dataclasses import dataclass, replace

import numpy as np

from coupling.robot.parameter_table import PARAMETER_KINDS
from coupling.robot.parameters import part_of, place_of
from elastic_robot.body import Body
from elastic_robot.description import Joint, Robot

# A backlash below this is none, as crossing it takes no time that counts [rad].
_NO_BACKLASH = 1e-8
# Numbers of sensors that add to the motor's torque.
_OF_TORQUE = ("rest", "rate", "inertia")


@dataclass(frozen=True)
class MotionParameter:
    """How a number of a robot is fitted, as the row of its kind says, or one of its sensors.

    Attributes:
        name: Name of the robot's parameter, `joint[2].stiffness`, or that of a sensor, `encoder[2].lag`.
        term: Term of the equations of motion, of which others may be numbers too.
        joint: Index of its joint; that of the last one for the payload.
        size: Usual size, in its unit: with a wider interval it is not identifiable.
        unit: Its unit.
        value: Its value in the start, in its unit.
        none: Its value where its term is left out; the start's where a robot needs one.
        signed: Whether it may be negative.
        inverse: Whether the fit counts by its inverse, of which the motion is nearly linear.
        moves_gears: Whether the gears' motion follows it.
        vanishes: Whether it may turn out to be none, which a narrow interval around none shows.
        most: Highest value, in usual sizes.
        prior: Standard deviation around the start, as the fit counts [1]; infinite if nothing is known.
        sensor: Kind of a number that the model has not, the same in all recordings: "lag", "cosine",
            "sine" or "loop" of the wind-up; of the torque "rest", or "rate" and "inertia" of what is
            faster than the bandwidth; "" of a robot's.
        harmonic: Periods in a turn of a cosine or sine, for a slow error of an encoder.
    """

    name: str
    term: str
    joint: int
    size: float
    unit: str
    value: float
    none: float = 0.0
    signed: bool = False
    inverse: bool = False
    moves_gears: bool = True
    vanishes: bool = False
    most: float = 30.0
    prior: float = np.inf
    sensor: str = ""
    harmonic: int = 0

    @classmethod
    def of_sensor(
        cls,
        name: str,
        term: str,
        joint: int,
        size: float,
        unit: str,
        sensor: str,
        prior: float = 1.0,
        harmonic: int = 0,
    ) -> MotionParameter:
        """Return a number of a sensor, about none; arguments as the attributes."""
        of_robot = cls(name, term, joint, size, unit, 0.0, signed=True, moves_gears=False)
        return replace(of_robot, sensor=sensor, prior=prior, harmonic=harmonic)

    @classmethod
    def of(cls, robot: Robot, name: str, joint: int) -> MotionParameter:
        """Return a robot's parameter by its name, for a kind that has a `MotionTerm`.

        Args:
            joint: As of the attributes.
        """
        kind, part = PARAMETER_KINDS[place_of(name)[2]], part_of(robot, name)
        term, value = kind.motion, kind.read(part)
        assert term is not None
        return cls(
            name,
            term.name if term.part == "payload" else f"{term.name} {joint + 1}",
            joint,
            value if term.size is None else term.size(part),
            kind.unit,
            value,
            none=value if term.is_needed else 0.0,
            signed=term.is_signed,
            inverse=kind.inverse,
            moves_gears=not kind.of_motor,
            vanishes=term.vanishes,
            most=term.most,
            prior=term.prior,
        )

    @property
    def of_gear(self) -> bool:
        """Whether it is a number of the gear's wind-up."""
        return self.name.endswith((".stiffness", ".backlash", ".hysteresis"))

    @property
    def of_torque(self) -> bool:
        """Whether a motor's torque alone follows it, not the wind-up."""
        return self.sensor in _OF_TORQUE if self.sensor else not self.moves_gears

    @property
    def of_slow_error(self) -> bool:
        """Whether it is a harmonic of an encoder's slow error, whose function alone has a meaning."""
        return self.harmonic > 0

    def inward(self, value: float) -> float:
        """Return what the fit counts by: parts of its usual size."""
        return self.size / value if self.inverse else value / self.size

    def outward(self, counted: float) -> float:
        """Return the value in its unit; infinite where a stiffness is beyond all measure."""
        if self.inverse:
            return self.size / counted if counted > 0.0 else np.inf
        return counted * self.size

    def in_robot(self, counted: float) -> float:
        """Return the value that a robot is given."""
        value = self.outward(counted)
        return 0.0 if self.vanishes and value <= _NO_BACKLASH else value


def motion_parameters(robot: Robot, with_link: Iterable[int]) -> tuple[MotionParameter, ...]:
    """Return the parameters of a robot that its motion can identify.

    Args:
        with_link: Indices of joints whose link's angle is measured.
    """
    measured, last = set(with_link), len(robot.joints) - 1
    names: list[tuple[str, int]] = []
    for i, joint in enumerate(robot.joints):
        parts = {"gear": i in measured, "balancer": True, "motor": joint.drive is not None}
        names += [(f"joint[{i + 1}].{key}", i) for key in _kinds_of(joint, parts)]
    if robot.payload is not None and robot.payload.mass > 0.0:
        names += [(f"payload.{key}", last) for key in _kinds_of(robot.payload, {"payload": True})]
    return tuple(MotionParameter.of(robot, name, joint) for name, joint in names)


def _kinds_of(part: Joint | Body, parts: Mapping[str, bool]) -> Iterator[str]:
    """Yield the kinds that a joint or payload has, of those parts that are looked at."""
    for key, kind in PARAMETER_KINDS.items():
        term = kind.motion
        is_looked_at = term is not None and parts.get(term.part, False)
        if term and is_looked_at and (term.size is not None or kind.read(part) > 0.0):
            yield key
