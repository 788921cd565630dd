"""Parameters that a motion may identify, by the term of the equations that they belong to."""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from dataclasses import dataclass
from typing import Any

import numpy as np

from coupling.robot.parameters import dry_friction, unit_of, value_of
from elastic_robot.description import Joint, Robot

# A backlash below this is none, as crossing it takes no time that counts [rad].
_NO_BACKLASH = 1e-8
# Stiffness and rotor come from data sheets: standard deviation around the file's, in parts of it.
_DATA_SHEET = 0.5
# A data sheet says at most how much backlash there is: standard deviation, in parts of the file's.
_BACKLASH = 1.0


@dataclass(frozen=True)
class MotionParameter:
    """How a number of a robot is fitted, which `coupling.robot.parameters` reads and writes by its name.

    Attributes:
        name: Name of the robot's parameter, `joint[2].stiffness`.
        term: Term of the equations of motion, of which others may be numbers too.
        joint: Index of its joint; that of the last one for the payload.
        size: Usual size, in its unit: with a wider interval it is not identifiable.
        unit: Its unit.
        start: Its value in the start, in its unit.
        none: Its value where its term is left out; the start's where a robot needs one.
        signed: Whether it may be negative.
        inverse: Whether the fit counts by its inverse, of which the motion is nearly linear.
        moves_gears: Whether the gears' motion follows it.
        vanishes: Whether it may turn out to be none, which a narrow interval around none shows.
        most: Highest value, in usual sizes.
        prior: Standard deviation around the start, as the fit counts [1]; infinite if nothing is known.
    """

    name: str
    term: str
    joint: int
    size: float
    unit: str
    start: float
    none: float = 0.0
    signed: bool = False
    inverse: bool = False
    moves_gears: bool = True
    vanishes: bool = False
    most: float = 30.0
    prior: float = np.inf

    @classmethod
    def of(
        cls,
        robot: Robot,
        name: str,
        term: str,
        joint: int,
        size: float | None = None,
        **further: Any,
    ) -> MotionParameter:
        """Return a robot's parameter; its usual size is the start's if none is given."""
        start = value_of(robot, name)
        usual = start if size is None else size
        return cls(name, term, joint, usual, unit_of(name), start, **further)

    @property
    def of_gear(self) -> bool:
        """Whether it is a number of the gear's wind-up."""
        return self.name.endswith((".stiffness", ".backlash", ".hysteresis"))

    @property
    def of_torque(self) -> bool:
        """Whether a motor's torque alone follows it."""
        return not self.moves_gears

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
    measured, found = set(with_link), []
    for i, joint in enumerate(robot.joints):
        own = [*(_of_gear(joint) if i in measured else ()), *_of_balancer(joint), *_of_motor(joint)]
        found += [
            MotionParameter.of(robot, f"joint[{i + 1}].{key}", f"{term} {i + 1}", i, **further)
            for key, term, further in own
        ]
    return (*found, *_of_payload(robot))


# What follows a joint in the parameter's name, the term without the joint's number, further fields.
_Row = tuple[str, str, dict[str, Any]]


def _of_gear(joint: Joint) -> Iterator[_Row]:
    yield "stiffness", "stiffness", {"none": joint.stiffness, "inverse": True, "prior": _DATA_SHEET}
    if joint.backlash > 0.0:
        yield "backlash", "backlash", {"vanishes": True, "most": 3.0, "prior": _BACKLASH}
    if joint.hysteresis:
        yield "hysteresis", "hysteresis", {}


def _of_balancer(joint: Joint) -> Iterator[_Row]:
    if joint.balancer is not None:
        yield "balancer", "balancer", {}


def _of_motor(joint: Joint) -> Iterator[_Row]:
    drive = joint.drive
    if drive is None:
        return
    alone: dict[str, Any] = {"moves_gears": False}
    dry = alone | {"size": max(dry_friction(drive)[0], 1.0)}
    yield "drive.friction.coulomb_Nm", "friction", dry
    yield "drive.friction.more_at_rest", "Stribeck", dry
    viscous = alone | {"size": max(drive.viscous, 1.0)}
    yield "drive.friction.viscous_Nm_s", "viscous friction", viscous
    yield "drive.inertia", "rotor", alone | {"none": drive.inertia, "prior": _DATA_SHEET}
    if drive.load_friction > 0.0:
        yield "drive.load_friction", "load friction", alone


def _of_payload(robot: Robot) -> list[MotionParameter]:
    body, last, term = robot.payload, len(robot.joints) - 1, "payload"
    if body is None or body.mass == 0.0:
        return []
    return [
        MotionParameter.of(robot, "payload.mass", term, last, none=body.mass),
        *(
            MotionParameter.of(
                robot, f"payload.com.{axis}", term, last, size=0.1, none=own, signed=True
            )
            for axis, own in zip("xyz", body.com, strict=True)
        ),
    ]
