"""Parameters of a robot by name: which it has, their values, and the robot with other ones."""

from __future__ import annotations

import re
from collections.abc import Iterable, Iterator, Mapping
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from coupling.robot.parameter_kind import ParameterKind
from coupling.robot.parameter_table import PARAMETER_KINDS
from elastic_robot.chain import build_chain
from elastic_robot.description import Joint, Robot
from elastic_robot.fmi.interface import IDEAL
from elastic_robot.torque_curves import TORQUE_CURVES

_NAME = re.compile(r"(?:joint\[(\d+)\](?:\.tilt\[(\d+)\])?|payload)\.(.+)")


@dataclass(frozen=True)
class RobotParameter:
    """One parameter of a robot's elastic coordinates and motors.

    Attributes:
        name: Its name, `joint[1].stiffness`.
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
    def unit(self) -> str:
        """Its unit."""
        return self.row.unit

    @property
    def row(self) -> ParameterKind:
        """What is said of its kind."""
        return PARAMETER_KINDS[self.kind]

    @property
    def vibrates(self) -> bool:
        """Whether it is a tilt's damping, which acts in vibrations alone."""
        return self.gear is None and self.kind == "damping"


def robot_parameters(
    robot: Robot, torque_curve: str, kinds: Iterable[str], drive: str = ""
) -> tuple[RobotParameter, ...]:
    """Return the parameters of a robot that are not zero and act, kind by kind.

    Args:
        torque_curve: A name of `TORQUE_CURVES`, which may have no backlash; a gear whose own table it
            takes has neither backlash nor stiffness.
    """
    chain = build_chain(robot)
    coordinates = {name: row for row, name in enumerate(chain.elastic_names)}
    gears = {int(row): gear for gear, row in enumerate(chain.torsions)}
    parameters = []
    for key in kinds:
        for place, part in acting_parts(robot, torque_curve, drive, PARAMETER_KINDS[key]):
            value = PARAMETER_KINDS[key].read(part)
            if value > 0.0:
                row = coordinates[place]
                gear = gears.get(row)
                parameters.append(RobotParameter(f"{place}.{key}", key, row, gear, value))
    return tuple(parameters)


def acting_parts(
    robot: Robot, torque_curve: str, drive: str, kind: ParameterKind
) -> Iterator[tuple[str, Any]]:
    """Yield the joints and tilts where a kind of parameter may change anything, by name."""
    if kind.of_motor and drive == IDEAL:
        return
    for place, part in _parts(robot):
        if kind.acts is None or kind.acts(part, TORQUE_CURVES[torque_curve]):
            yield place, part


def _parts(robot: Robot) -> Iterator[tuple[str, Any]]:
    for i, joint in enumerate(robot.joints, start=1):
        yield f"joint[{i}]", joint
        for k, tilt in enumerate(joint.tilt, start=1):
            yield f"joint[{i}].tilt[{k}]", tilt


def place_of(name: str) -> tuple[int, int, str]:
    """Return the joint's and the tilt's number of a parameter, and what stands behind them.

    Numbers are from 1; joint 0 is the payload, tilt 0 the torsion.

    Example:
        >>> place_of("joint[3].tilt[1].stiffness"), place_of("payload.com.x")
        ((3, 1, 'stiffness'), (0, 0, 'com.x'))
    """
    match = _NAME.match(name)
    assert match is not None, name
    joint, tilt, kind = match.groups()
    return int(joint or 0), int(tilt or 0), kind


def part_of(robot: Robot, name: str) -> Any:
    """Return the joint, the tilt or the payload that has a parameter, by name."""
    joint, tilt, _ = place_of(name)
    part: Any = robot.joints[joint - 1] if joint else robot.payload
    return part.tilt[tilt - 1] if tilt else part


def value_of(robot: Robot, name: str) -> float:
    """Return a parameter's value, in its unit, by name; 0 where its part has none."""
    return PARAMETER_KINDS[place_of(name)[2]].read(part_of(robot, name))


def unit_of(name: str) -> str:
    """Return a parameter's unit by its name."""
    return PARAMETER_KINDS[place_of(name)[2]].unit


def with_joints(robot: Robot, changed: Mapping[int, Joint]) -> Robot:
    """Return the robot with other joints in the place of some, by their numbers from 0."""
    joints = (changed.get(i, joint) for i, joint in enumerate(robot.joints))
    return replace(robot, joints=tuple(joints))


def apply_values(robot: Robot, values: Mapping[str, float]) -> Robot:
    """Return the robot with other values of its parameters, by name, each in its unit.

    The elements of a gear keep their shares, and the ratios of their slip angles.

    Example:
        >>> from coupling.files.robot_file import find_robot, load_robot
        >>> softer = apply_values(load_robot(find_robot("icme2008")), {"joint[1].stiffness": 2e5})
        >>> value_of(softer, "joint[1].stiffness")
        200000.0
    """
    joints, payload = list(robot.joints), robot.payload
    for name, value in values.items():
        number, tilt, key = place_of(name)
        kind = PARAMETER_KINDS[key]
        value = min(max(value, kind.least), kind.most)
        if not number:
            payload = kind.write(payload, value)
        elif not tilt:
            joints[number - 1] = kind.write(joints[number - 1], value)
        else:
            joint = joints[number - 1]
            tilts = list(joint.tilt)
            tilts[tilt - 1] = kind.write(tilts[tilt - 1], value)
            joints[number - 1] = replace(joint, tilt=tuple(tilts))
    return replace(robot, joints=tuple(joints), payload=payload)


def scaled_values(parameters: Iterable[RobotParameter], x: np.ndarray) -> dict[str, float]:
    """Return the values of parameters with log factors x [1], (P,), by name."""
    pairs = zip(parameters, x, strict=True)
    return {parameter.name: parameter.value * float(np.exp(log)) for parameter, log in pairs}
