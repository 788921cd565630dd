"""Parameters of a robot that are fitted: of gears, tilts and the friction of motors."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from elastic_robot.chain import build_chain
from elastic_robot.description import Joint, Robot
from elastic_robot.parameters import Parameters

# What every robot has, and what gears with hysteresis and motors have beside.
KINDS = ("backlash", "stiffness", "damping")
SLIPPING = ("hysteresis", "friction")
# The largest slip angle of a gear's elements, to which the others are in proportion.
SLIP_ANGLE = "slip_angle"


@dataclass(frozen=True)
class RobotParameter:
    """One parameter of a robot.

    Attributes:
        name: Name in the FMU, `joint[1].stiffness`.
        kind: One of `KINDS`; or of `SLIPPING`: "hysteresis", the torque at which all elements of a gear
            slip, "friction", that of a motor at rest; or `SLIP_ANGLE`.
        coordinate: Number of its elastic coordinate; of a motor that of its gear.
        gear: Number of its gear; None for a tilt.
        value: Value in the robot file [N m/rad, N m s/rad, rad, N m].
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
        robot: The robot.
        torque_curve: A name of `TORQUE_CURVES`; a linear one has no backlash, and a gear with a table of
            its own under "spline" neither backlash nor stiffness.
        kinds: Those that count, in their order.
    """
    chain, nominal = build_chain(robot), Parameters.of(robot)
    found = []
    for kind in kinds:
        for row, name in enumerate(chain.elastic_names):
            tilt = bool(chain.elastic_tilt[row])
            tabled = torque_curve == "spline" and nominal.tables[row] is not None
            if kind == "backlash" and (tilt or torque_curve == "linear"):
                continue
            value = _value(robot, nominal, kind, row, int(chain.elastic_joint[row]), tilt)
            gear = None if tilt else int(np.flatnonzero(chain.torsions == row)[0])
            if value > 0.0 and (kind not in ("stiffness", "backlash") or not tabled):
                found.append(RobotParameter(f"{name}.{kind}", kind, row, gear, value))
    return tuple(found)


def _value(robot: Robot, nominal: Parameters, kind: str, row: int, joint: int, tilt: bool) -> float:
    """Return the value of an elastic coordinate's parameter; 0 where it has none."""
    own = robot.joints[joint]
    if kind == SLIP_ANGLE:
        return own.hysteresis[-1].slip_angle if own.hysteresis and not tilt else 0.0
    if kind != "friction":
        return float(getattr(nominal, kind)[row])
    return 0.0 if own.drive is None or tilt else own.drive.friction


def with_joints(robot: Robot, changed: Mapping[int, Joint]) -> Robot:
    """Return the robot with other joints in the place of some, by their numbers from 0."""
    joints = (changed.get(i, own) for i, own in enumerate(robot.joints))
    return replace(robot, joints=tuple(joints))


def with_values(robot: Robot, values: Mapping[str, float]) -> Robot:
    """Return the robot with other values of its parameters, by name.

    The elements of a gear keep their shares, and the ratios of their slip angles.
    """

    def changed(place: str, own: Any) -> Any:
        return replace(
            own, **{k: values[f"{place}.{k}"] for k in KINDS if f"{place}.{k}" in values}
        )

    def slipping(name: str, own: Joint) -> Joint:
        torque, friction = (values.get(f"{name}.{kind}") for kind in SLIPPING)
        angle, stops = values.get(f"{name}.{SLIP_ANGLE}"), own.hysteresis
        if torque is not None:
            factor = torque / sum(stop.slip_torque for stop in stops)
            stops = tuple(replace(stop, slip_torque=factor * stop.slip_torque) for stop in stops)
        if angle is not None:
            factor = angle / stops[-1].slip_angle
            stops = tuple(replace(stop, slip_angle=factor * stop.slip_angle) for stop in stops)
        own = replace(own, hysteresis=stops)
        if friction is not None and own.drive is not None:
            own = replace(own, drive=replace(own.drive, friction=friction))
        return own

    joints = []
    for number, joint in enumerate(robot.joints, start=1):
        name = f"joint[{number}]"
        tilts = tuple(
            changed(f"{name}.tilt[{k}]", tilt) for k, tilt in enumerate(joint.tilt, start=1)
        )
        joints.append(replace(slipping(name, changed(name, joint)), tilt=tilts))
    return replace(robot, joints=tuple(joints))
