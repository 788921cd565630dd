"""What is identified of a robot at rest: compliances, and backlash and hysteresis of its gears."""

from __future__ import annotations

from collections.abc import Collection
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np

from coupling.robot.parameter_table import PARAMETER_KINDS
from coupling.robot.parameters import (
    RobotParameter,
    apply_values,
    place_of,
    robot_parameters,
    with_joints,
)
from elastic_robot.description import Joint, Robot, Tilt
from elastic_robot.torque_curves import TORQUE_CURVES

# What a coordinate is taken for that gives way by nothing measurable [rad/(N m), rad].
LEAST_COMPLIANCE, LEAST_BACKLASH = 1e-14, 1e-10
_KINDS_AT_REST = tuple(key for key, kind in PARAMETER_KINDS.items() if kind.at_rest)


@dataclass(frozen=True)
class ElasticParameters:
    """The parameters p: compliance of every elastic coordinate, then backlash and hysteresis of gears.

    Their units: compliances 1/k [rad/(N m)], half widths of backlash [rad].  `joint[i].hysteresis` is
    the torque at which all elements of a gear slip [N m]; `joint[i].slip_angle`, of a gear that the file
    has without elements, the largest slip angle [rad], to which the others are in proportion.

    Attributes:
        robot: The robot they belong to.
        parameters: Its parameters, (P,).
    """

    robot: Robot
    parameters: tuple[RobotParameter, ...]

    @classmethod
    def of(cls, robot: Robot, torque_curve: str, shaped: Collection[int] = ()) -> ElasticParameters:
        """Return the parameters of a robot: backlash where it has any and the curve knows it.

        A gear whose torque the curve takes from its own table has none.

        Args:
            torque_curve: A name of `TORQUE_CURVES`.
            shaped: Numbers of joints, from 0, whose slip angles are fitted as well.
        """
        every = robot_parameters(robot, torque_curve, _KINDS_AT_REST)
        return cls(
            robot, tuple(p for p in every if p.kind != "slip_angle" or joint_of(p) in shaped)
        )

    @cached_property
    def names(self) -> tuple[str, ...]:
        """Names in the FMU, joint[1].stiffness or joint[1].backlash, (P,)."""
        return tuple(parameter.name for parameter in self.parameters)

    @cached_property
    def elastic(self) -> np.ndarray:
        """Indices of their elastic coordinates, (P,)."""
        return np.array([parameter.coordinate for parameter in self.parameters], dtype=int)

    def chosen(self, kind: str) -> np.ndarray:
        """Return the mask of parameters of a kind, (P,)."""
        return np.array([parameter.kind == kind for parameter in self.parameters], dtype=bool)

    def together(self, j: int) -> np.ndarray:
        """Return the mask of those that stand and fall with one: a slip torque has its angle, (P,)."""
        parameter = self.parameters[j]
        with_it = [
            parameter.kind == "hysteresis" and p.coordinate == parameter.coordinate
            for p in self.parameters
        ]
        mask = np.array(with_it) & self.chosen("slip_angle")
        mask[j] = True
        return mask

    @cached_property
    def is_compliance(self) -> np.ndarray:
        """Mask of compliances 1/k [rad/(N m)]; the others are as in the robot file, (P,)."""
        return np.array([parameter.row.inverse for parameter in self.parameters], dtype=bool)

    @cached_property
    def is_torsion(self) -> np.ndarray:
        """Mask of compliances of a joint about its own axis, (P,)."""
        return self.is_compliance & [parameter.gear is not None for parameter in self.parameters]

    @cached_property
    def start(self) -> np.ndarray:
        """Values in the robot's description, in p's units, (P,)."""
        value = np.array([parameter.value for parameter in self.parameters])
        return np.where(self.is_compliance, 1.0 / value, value)

    @property
    def least(self) -> np.ndarray:
        """Smallest values that the model is computed with, in p's units, (P,)."""
        return np.where(self.is_compliance, LEAST_COMPLIANCE, LEAST_BACKLASH)

    def described(self, values: np.ndarray) -> Robot:
        """Return the robot with values of p, in its units, (P,)."""
        written = self.in_units(np.maximum(values, self.least)).tolist()
        return apply_values(self.robot, dict(zip(self.names, written, strict=True)))

    def in_units(self, values: np.ndarray) -> np.ndarray:
        """Return p, (P,), with stiffnesses [N m/rad] in place of compliances; infinite for none."""
        with np.errstate(divide="ignore"):
            return np.where(self.is_compliance, 1.0 / np.maximum(values, 0.0), values)


def joint_of(parameter: RobotParameter) -> int:
    """Return the number of a parameter's joint, from 0."""
    return place_of(parameter.name)[0] - 1


@dataclass(frozen=True)
class Candidate:
    """A parameter that a robot does not have.

    Attributes:
        name: joint[3].tilt about [0, 0, 1], or joint[3].backlash.
        joint: Number of the joint, from 0.
        axis: Axis of the tilt in the body's axes, (3,); None for a backlash.
    """

    name: str
    joint: int
    axis: tuple[float, ...] | None

    def in_units(self, value: float) -> float:
        """Return a compliance as a stiffness [N m/rad], infinite for none, or one as the other."""
        if self.axis is None:
            return value
        return 1.0 / value if value > 0.0 else np.inf

    def added_to(self, robot: Robot, value: float) -> tuple[Robot, str]:
        """Return the robot with this parameter, and the parameter's name in the FMU.

        Args:
            value: Compliance [rad/(N m)] or half width [rad].
        """
        name = self.name
        joint = robot.joints[self.joint]
        if self.axis is None:
            changed = replace(joint, backlash=max(value, LEAST_BACKLASH))
        else:
            stiffness = 1.0 / max(value, LEAST_COMPLIANCE)
            ratio = joint.damping / joint.stiffness if joint.stiffness else 0.0
            tilt = Tilt(self.axis, stiffness, ratio * stiffness)
            changed = replace(joint, tilt=(*joint.tilt, tilt))
            name = f"joint[{self.joint + 1}].tilt[{len(changed.tilt)}].stiffness"
        return with_joints(robot, {self.joint: changed}), name


def candidates(robot: Robot, torque_curve: str) -> list[Candidate]:
    """Return the tilts, and the backlashes, that joints may have beside what they have."""
    possible = []
    for i, joint in enumerate(robot.joints):
        if joint.stiffness is None and not joint.tilt:
            continue  # a joint that the file takes for rigid
        for axis in _lateral(joint)[: 2 - len(joint.tilt)]:
            words = ", ".join(f"{component:.4g}" for component in axis)
            possible.append(Candidate(f"joint[{i + 1}].tilt about [{words}]", i, axis))
    if TORQUE_CURVES[torque_curve].has_backlash:
        for i, joint in enumerate(robot.joints):
            if joint.stiffness is not None and joint.backlash == 0.0 and not joint.torque_table:
                possible.append(Candidate(f"joint[{i + 1}].backlash", i, None))
    return possible


def _lateral(joint: Joint) -> list[tuple[float, ...]]:
    """Return the directions across a joint's axis, and its tilts': body axes where these lie so."""
    directions = [np.array(joint.axis), *(np.array(tilt.axis) for tilt in joint.tilt)]
    lateral: list[tuple[float, ...]] = []
    order = np.argsort(np.abs(joint.axis), kind="stable")
    for axis in np.eye(3)[order]:
        for other in directions:
            axis = axis - (axis @ other) / (other @ other) * other
        length = np.linalg.norm(axis)
        if length > 0.1:
            unit = axis / length + 0.0
            lateral.append(tuple(unit.tolist()))
            directions.append(unit)
    return lateral
