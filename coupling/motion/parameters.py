"""What a motion may tell of a robot: its numbers, by the term of the equations that they belong to."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from elastic_robot.description import Robot

Place = tuple[str | int, ...]


@dataclass(frozen=True)
class MotionParameter:
    """A number of a robot that is fitted.

    Attributes:
        name: Place in the robot file, `joint[2].stiffness`.
        term: Term of the equations of motion, of which others may be numbers too.
        joint: Index of its joint; that of the last one for the payload.
        path: Where it stands in the description.
        size: What it usually is, in its unit: an interval wider than this tells nothing.
        unit: Its unit.
        signed: Whether it may be negative.
        inverse: Whether the fit counts by its inverse, of which the motion is nearly linear.
        moves: Whether the motion of the links follows it, not the motors' torque alone.
    """

    name: str
    term: str
    joint: int
    path: Place
    size: float
    unit: str
    signed: bool = False
    inverse: bool = False
    moves: bool = True

    def value(self, robot: Robot) -> float:
        """Return its value in a robot, in its unit."""
        own: Any = robot
        for key in self.path:
            own = own[key] if isinstance(key, int) else getattr(own, key)
        return float(own)

    def inward(self, value: float) -> float:
        """Return what the fit counts by: parts of its usual size."""
        return self.size / value if self.inverse else value / self.size

    def outward(self, counted: float) -> float:
        """Return the value in its unit; infinite where a stiffness is beyond all measure."""
        if self.inverse:
            return self.size / counted if counted > 0.0 else np.inf
        return counted * self.size


def replaced(own: Any, path: Place, value: float) -> Any:
    """Return a description with another number at a place."""
    key, *rest = path
    if isinstance(key, int):
        new = value if not rest else replaced(own[key], tuple(rest), value)
        return (*own[:key], new, *own[key + 1 :])
    inside = getattr(own, key)
    return replace(own, **{key: value if not rest else replaced(inside, tuple(rest), value)})


def with_numbers(robot: Robot, values: Iterable[tuple[MotionParameter, float]]) -> Robot:
    """Return the robot with other numbers, each in its unit."""
    for parameter, value in values:
        robot = replaced(robot, parameter.path, value)
    return robot


def motion_parameters(robot: Robot, with_link: Iterable[int]) -> tuple[MotionParameter, ...]:
    """Return the numbers of a robot that its motion can tell.

    Args:
        robot: The robot.
        with_link: Indices of joints whose link's angle is measured.
    """
    found: list[MotionParameter] = []
    measured = set(with_link)
    last = len(robot.joints) - 1
    for i, joint in enumerate(robot.joints):
        name, path = f"joint[{i + 1}]", ("joints", i)
        if i in measured:
            assert joint.stiffness is not None
            found.append(
                MotionParameter(
                    f"{name}.stiffness",
                    f"stiffness {i + 1}",
                    i,
                    (*path, "stiffness"),
                    joint.stiffness,
                    "N m/rad",
                    inverse=True,
                )
            )
            for k, element in enumerate(joint.hysteresis):
                found.append(
                    MotionParameter(
                        f"{name}.hysteresis[{k + 1}]",
                        f"hysteresis {i + 1}",
                        i,
                        (*path, "hysteresis", k, "slip_torque"),
                        element.slip_torque,
                        "N m",
                    )
                )
        if joint.drive is not None:
            drive = (*path, "drive")
            dry = max(joint.drive.friction, 1.0)
            found.append(
                MotionParameter(
                    f"{name}.drive.friction.coulomb_Nm",
                    f"friction {i + 1}",
                    i,
                    (*drive, "friction"),
                    dry,
                    "N m",
                    moves=False,
                )
            )
            found.append(
                MotionParameter(
                    f"{name}.drive.friction.viscous_Nm_s",
                    f"viscous friction {i + 1}",
                    i,
                    (*drive, "viscous"),
                    max(joint.drive.viscous, 1.0),
                    "N m s/rad",
                    moves=False,
                )
            )
    if robot.payload is not None and robot.payload.mass > 0.0:
        mass = robot.payload.mass
        found.append(
            MotionParameter("payload.mass", "payload", last, ("payload", "mass"), mass, "kg")
        )
        for k, axis in enumerate("xyz"):
            found.append(
                MotionParameter(
                    f"payload.com.{axis}",
                    "payload",
                    last,
                    ("payload", "com", k),
                    0.1,
                    "m",
                    signed=True,
                )
            )
    return tuple(found)
