"""Parameters of a robot by name: their units and bounds, how they are read and written."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from coupling.files.robot_edit import place_of
from elastic_robot.chain import build_chain
from elastic_robot.description import Body, Joint, Robot
from elastic_robot.gear_parts import Drive
from elastic_robot.parameters import Parameters
from elastic_robot.torque_curves import TORQUE_CURVES

# What every robot has, and what gears with hysteresis and motors have beside.
KINDS = ("backlash", "stiffness", "damping")
SLIPPING = ("hysteresis", "friction")
# The largest slip angle of a gear's elements, to which the others are in proportion.
SLIP_ANGLE = "slip_angle"


@dataclass(frozen=True)
class ParameterKind:
    """A number that a joint, a tilt or the payload has.

    Attributes:
        unit: Its unit.
        read: Function that returns its value in a part of the robot; 0 where that has none.
        write: Function that returns the part with another value.
        least, most: Bounds of what a model can be computed with; what is beyond is written as the bound.
    """

    unit: str
    read: Callable[[Any], float]
    write: Callable[[Any, float], Any]
    least: float = -np.inf
    most: float = np.inf


@dataclass(frozen=True)
class RobotParameter:
    """One parameter of a robot's elastic coordinates and motors.

    Attributes:
        name: Name in the FMU, `joint[1].stiffness`.
        kind: One of `KINDS`; or of `SLIPPING`: "hysteresis", the torque at which all elements of a gear
            slip, "friction", that of a motor at rest; or `SLIP_ANGLE`.
        coordinate: Number of its elastic coordinate; of a motor that of its gear.
        gear: Number of its gear; None for a tilt.
        value: Value in the robot file, in its unit.
    """

    name: str
    kind: str
    coordinate: int
    gear: int | None
    value: float

    @property
    def vibrates(self) -> bool:
        """Whether it is a tilt's damping, which acts in vibrations alone."""
        return self.gear is None and self.kind == "damping"


def robot_parameters(
    robot: Robot, torque_curve: str, kinds: Sequence[str] = KINDS
) -> tuple[RobotParameter, ...]:
    """Return the parameters of a robot that are not zero, kind by kind.

    Args:
        torque_curve: A name of `TORQUE_CURVES`, which may have no backlash; a gear whose own table it
            takes has neither backlash nor stiffness.
        kinds: Those that count, in their order.
    """
    chain, tables = build_chain(robot), Parameters.of(robot).tables
    curve = TORQUE_CURVES[torque_curve]
    found = []
    for kind in kinds:
        for row, name in enumerate(chain.elastic_names):
            tilt = bool(chain.elastic_tilt[row])
            tabled = curve.takes_tables and tables[row] is not None
            if kind == "backlash" and (tilt or not curve.has_backlash):
                continue
            value = value_of(robot, f"{name}.{kind}")
            gear = None if tilt else int(np.flatnonzero(chain.torsions == row)[0])
            if value > 0.0 and (kind not in ("stiffness", "backlash") or not tabled):
                found.append(RobotParameter(f"{name}.{kind}", kind, row, gear, value))
    return tuple(found)


def with_joints(robot: Robot, changed: Mapping[int, Joint]) -> Robot:
    """Return the robot with other joints in the place of some, by their numbers from 0."""
    joints = (changed.get(i, own) for i, own in enumerate(robot.joints))
    return replace(robot, joints=tuple(joints))


def value_of(robot: Robot, name: str) -> float:
    """Return a parameter's value, in its unit, by name; 0 where its part has none."""
    joint, tilt, kind = place_of(name)
    part: Any = robot.joints[joint - 1] if joint else robot.payload
    return PARAMETER_KINDS[kind].read(part.tilt[tilt - 1] if tilt else part)


def unit_of(name: str) -> str:
    """Return a parameter's unit by its name."""
    return PARAMETER_KINDS[place_of(name)[2]].unit


def with_values(robot: Robot, values: Mapping[str, float]) -> Robot:
    """Return the robot with other values of its parameters, by name, each in its unit.

    The elements of a gear keep their shares, and the ratios of their slip angles.

    Example:
        >>> body = Body(1.0, (0.0, 0.0, 0.0), (0.1, 0.1, 0.1))
        >>> one = Robot("one", (Joint((0.0, 0.0, 0.0), (0.0, 0.0, 1.0), body, stiffness=1e5),))
        >>> value_of(with_values(one, {"joint[1].stiffness": 2e5}), "joint[1].stiffness")
        200000.0
    """
    joints, payload = list(robot.joints), robot.payload
    for name, value in values.items():
        joint, tilt, key = place_of(name)
        kind = PARAMETER_KINDS[key]
        value = min(max(value, kind.least), kind.most)
        if not joint:
            payload = kind.write(payload, value)
        elif not tilt:
            joints[joint - 1] = kind.write(joints[joint - 1], value)
        else:
            tilts = list(joints[joint - 1].tilt)
            tilts[tilt - 1] = kind.write(tilts[tilt - 1], value)
            joints[joint - 1] = replace(joints[joint - 1], tilt=tuple(tilts))
    return replace(robot, joints=tuple(joints), payload=payload)


def dry_friction(drive: Drive) -> tuple[float, float]:
    """Return the friction at high rates, and what there is more of it at rest [N m]."""
    more = drive.stribeck * drive.friction
    return drive.friction - more, more


def _with_dry(drive: Drive, slipping: float, more: float) -> Drive:
    at_rest = slipping + more
    return replace(drive, friction=at_rest, stribeck=more / at_rest if at_rest > 0.0 else 0.0)


def _with_torque(joint: Joint, torque: float) -> Joint:
    """Return the joint with another torque at which all elements of its gear slip [N m]."""
    factor = torque / sum(stop.slip_torque for stop in joint.hysteresis)
    stops = (replace(stop, slip_torque=factor * stop.slip_torque) for stop in joint.hysteresis)
    return replace(joint, hysteresis=tuple(stops))


def _with_angle(joint: Joint, angle: float) -> Joint:
    """Return the joint with another largest slip angle of its gear's elements [rad]."""
    factor = angle / max(stop.slip_angle for stop in joint.hysteresis)
    stops = (replace(stop, slip_angle=factor * stop.slip_angle) for stop in joint.hysteresis)
    return replace(joint, hysteresis=tuple(stops))


def _scaled_balancer(joint: Joint, factor: float) -> Joint:
    points = joint.balancer or ()
    return replace(joint, balancer=tuple((angle, factor * torque) for angle, torque in points))


def _field(key: str, unit: str, least: float = -np.inf) -> ParameterKind:
    """Return the kind of a field of its part."""
    return ParameterKind(
        unit,
        lambda own: getattr(own, key, None) or 0.0,
        lambda own, value: replace(own, **{key: value}),
        least,
    )


def _of_drive(
    unit: str,
    read: Callable[[Drive], float],
    write: Callable[[Drive, float], Drive],
    least: float = -np.inf,
    most: float = np.inf,
) -> ParameterKind:
    """Return the kind of a number of a joint's drive."""

    def of_joint(own: Any) -> float:
        drive = getattr(own, "drive", None)
        return 0.0 if drive is None else read(drive)

    def written(own: Joint, value: float) -> Joint:
        return own if own.drive is None else replace(own, drive=write(own.drive, value))

    return ParameterKind(unit, of_joint, written, least, most)


def _drive_field(key: str, unit: str, **bounds: float) -> ParameterKind:
    return _of_drive(
        unit,
        lambda drive: float(getattr(drive, key)),
        lambda drive, value: replace(drive, **{key: value}),
        **bounds,
    )


def _centre(k: int) -> ParameterKind:
    """Return the kind of a coordinate of a body's centre of mass."""

    def written(body: Body, value: float) -> Body:
        return replace(body, com=(*body.com[:k], value, *body.com[k + 1 :]))

    return ParameterKind("m", lambda body: float(body.com[k]), written)


# By what stands in a name behind its joint, its tilt or the payload.
PARAMETER_KINDS = {
    "stiffness": _field("stiffness", "N m/rad"),
    "damping": _field("damping", "N m s/rad"),
    "backlash": _field("backlash", "rad"),
    "hysteresis": ParameterKind(
        "N m",
        lambda own: sum(stop.slip_torque for stop in getattr(own, "hysteresis", ())),
        _with_torque,
        least=1e-9,
    ),
    SLIP_ANGLE: ParameterKind(
        "rad",
        lambda own: max((stop.slip_angle for stop in getattr(own, "hysteresis", ())), default=0.0),
        _with_angle,
    ),
    "balancer": ParameterKind("of the start's", lambda _: 1.0, _scaled_balancer),
    "friction": _drive_field("friction", "N m"),
    "drive.friction.coulomb_Nm": _of_drive(
        "N m",
        lambda drive: dry_friction(drive)[0],
        lambda drive, value: _with_dry(drive, value, dry_friction(drive)[1]),
    ),
    "drive.friction.more_at_rest": _of_drive(
        "N m",
        lambda drive: dry_friction(drive)[1],
        lambda drive, value: _with_dry(drive, dry_friction(drive)[0], value),
    ),
    "drive.friction.viscous_Nm_s": _drive_field("viscous", "N m s/rad"),
    "drive.load_friction": _drive_field("load_friction", "1", most=0.99),
    "drive.inertia": _drive_field("inertia", "kg m^2", least=1e-9),
    "mass": _field("mass", "kg", least=1e-6),
    **{f"com.{axis}": _centre(k) for k, axis in enumerate("xyz")},
}
