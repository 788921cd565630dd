"""Parameters that a motion may identify, by the term of the equations that they belong to."""

from __future__ import annotations

from collections.abc import Callable, Iterable
from dataclasses import dataclass, field, replace
from typing import Any

import numpy as np

from coupling.robot.parameters import with_joints, with_values
from elastic_robot.description import Body, Joint, Robot
from elastic_robot.gear_parts import Drive

# A backlash below 1e-8 rad is none, as crossing it takes no time that counts; elements slip at some
# torque.
_LEAST: dict[str, Callable[[float], float]] = {
    "backlash": lambda value: value if value > 1e-8 else 0.0,
    "hysteresis": lambda value: max(value, 1e-9),
}
# Stiffness and rotor come from data sheets: standard deviation around the file's, in parts of it.
_DATA_SHEET = 0.5


@dataclass(frozen=True)
class MotionParameter:
    """A number of a robot that is fitted.

    Attributes:
        name: Place in the robot file, `joint[2].stiffness`.
        term: Term of the equations of motion, of which others may be numbers too.
        joint: Index of its joint; that of the last one for the payload.
        size: Usual size, in its unit: with a wider interval it is not identifiable.
        unit: Its unit.
        start: Its value in the start, in its unit.
        put: Function that returns a robot with another value.
        none: Its value where its term is left out; the start's where a robot needs one.
        signed: Whether it may be negative.
        inverse: Whether the fit counts by its inverse, of which the motion is nearly linear.
        moves: Whether the links' motion follows it, not the motors' torque alone.
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
    put: Callable[[Robot, float], Robot] = field(repr=False)
    none: float = 0.0
    signed: bool = False
    inverse: bool = False
    moves: bool = True
    vanishes: bool = False
    most: float = 30.0
    prior: float = np.inf

    @property
    def of_gear(self) -> bool:
        """Whether it is a number of the gear's wind-up."""
        return self.name.endswith((".stiffness", ".backlash", ".hysteresis"))

    def inward(self, value: float) -> float:
        """Return what the fit counts by: parts of its usual size."""
        return self.size / value if self.inverse else value / self.size

    def outward(self, counted: float) -> float:
        """Return the value in its unit; infinite where a stiffness is beyond all measure."""
        if self.inverse:
            return self.size / counted if counted > 0.0 else np.inf
        return counted * self.size


def with_numbers(robot: Robot, values: Iterable[tuple[MotionParameter, float]]) -> Robot:
    """Return the robot with other numbers, each in its unit."""
    for parameter, value in values:
        robot = parameter.put(robot, value)
    return robot


def motion_parameters(robot: Robot, with_link: Iterable[int]) -> tuple[MotionParameter, ...]:
    """Return the parameters of a robot that its motion can identify.

    Args:
        robot: The robot.
        with_link: Indices of joints whose link's angle is measured.
    """
    measured, found = set(with_link), []
    for i, joint in enumerate(robot.joints):
        if i in measured:
            found += _of_gear(i, joint)
        if joint.balancer is not None:
            found.append(_of_balancer(i, joint))
        if joint.drive is not None:
            found += _of_friction(i, joint.drive)
    if robot.payload is not None and robot.payload.mass > 0.0:
        found += _of_payload(len(robot.joints) - 1, robot.payload)
    return tuple(found)


def dry_friction(drive: Drive) -> tuple[float, float]:
    """Return the friction at high rates, and what there is more of it at rest [N m]."""
    more = drive.stribeck * drive.friction
    return drive.friction - more, more


def _of_gear(i: int, joint: Joint) -> list[MotionParameter]:
    assert joint.stiffness is not None

    def own(kind: str, value: float, unit: str, **further: Any) -> MotionParameter:
        name = f"joint[{i + 1}].{kind}"

        def put(robot: Robot, value: float) -> Robot:
            least = _LEAST.get(kind)
            return with_values(robot, {name: value if least is None else least(value)})

        term = f"{kind} {i + 1}"
        return MotionParameter(name, term, i, value, unit, value, put, **further)

    k = joint.stiffness
    found = [own("stiffness", k, "N m/rad", none=k, inverse=True, prior=_DATA_SHEET)]
    if joint.backlash > 0.0:
        found.append(own("backlash", joint.backlash, "rad", vanishes=True, most=3.0))
    if joint.hysteresis:
        found.append(own("hysteresis", sum(e.slip_torque for e in joint.hysteresis), "N m"))
    return found


def _of_balancer(i: int, joint: Joint) -> MotionParameter:
    start = joint.balancer
    assert start is not None

    def balancer(joint: Joint, value: float) -> Joint:
        return replace(joint, balancer=tuple((angle, value * torque) for angle, torque in start))

    name = f"joint[{i + 1}].balancer"
    put = _put_joint(i, balancer)
    return MotionParameter(name, f"balancer {i + 1}", i, 1.0, "of the start's", 1.0, put)


def _of_friction(i: int, start: Drive) -> list[MotionParameter]:
    def coulomb(drive: Drive, value: float) -> Drive:
        return _with_dry(drive, value, dry_friction(drive)[1])

    def more(drive: Drive, value: float) -> Drive:
        return _with_dry(drive, dry_friction(drive)[0], value)

    def viscous(drive: Drive, value: float) -> Drive:
        return replace(drive, viscous=value)

    def inertia(drive: Drive, value: float) -> Drive:
        return replace(drive, inertia=max(value, 1e-9))

    def load(drive: Drive, value: float) -> Drive:
        return replace(drive, load_friction=min(value, 0.99))

    slipping, sticking = dry_friction(start)
    usual = max(slipping, 1.0)
    kinds = [
        ("friction.coulomb_Nm", "friction", slipping, usual, "N m", coulomb),
        ("friction.more_at_rest", "Stribeck", sticking, usual, "N m", more),
        (
            "friction.viscous_Nm_s",
            "viscous friction",
            start.viscous,
            max(start.viscous, 1.0),
            "N m s/rad",
            viscous,
        ),
        ("inertia", "rotor", start.inertia, start.inertia, "kg m^2", inertia),
    ]
    if start.load_friction > 0.0:
        kinds.append(
            ("load_friction", "load friction", start.load_friction, start.load_friction, "1", load)
        )
    return [
        MotionParameter(
            f"joint[{i + 1}].drive.{key}",
            f"{term} {i + 1}",
            i,
            size,
            unit,
            value,
            _put_drive(i, put),
            start.inertia if key == "inertia" else 0.0,
            moves=False,
            prior=_DATA_SHEET if key == "inertia" else np.inf,
        )
        for key, term, value, size, unit, put in kinds
    ]


def _of_payload(i: int, start: Body) -> list[MotionParameter]:
    def mass(robot: Robot, value: float) -> Robot:
        assert robot.payload is not None
        return replace(robot, payload=replace(robot.payload, mass=max(value, 1e-6)))

    def centre(k: int) -> Callable[[Robot, float], Robot]:
        def put(robot: Robot, value: float) -> Robot:
            assert robot.payload is not None
            com = (*robot.payload.com[:k], value, *robot.payload.com[k + 1 :])
            return replace(robot, payload=replace(robot.payload, com=com))

        return put

    term, reach = "payload", 0.1
    return [
        MotionParameter("payload.mass", term, i, start.mass, "kg", start.mass, mass, start.mass),
        *(
            MotionParameter(
                f"payload.com.{axis}", term, i, reach, "m", own, centre(k), own, signed=True
            )
            for k, (axis, own) in enumerate(zip("xyz", start.com, strict=True))
        ),
    ]


def _with_dry(drive: Drive, slipping: float, more: float) -> Drive:
    at_rest = slipping + more
    return replace(drive, friction=at_rest, stribeck=more / at_rest if at_rest > 0.0 else 0.0)


def _put_joint(i: int, change: Callable[[Joint, float], Joint]) -> Callable[[Robot, float], Robot]:
    def put(robot: Robot, value: float) -> Robot:
        return with_joints(robot, {i: change(robot.joints[i], value)})

    return put


def _put_drive(i: int, change: Callable[[Drive, float], Drive]) -> Callable[[Robot, float], Robot]:
    def changed(joint: Joint, value: float) -> Joint:
        assert joint.drive is not None
        return replace(joint, drive=change(joint.drive, value))

    return _put_joint(i, changed)
