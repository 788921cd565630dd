"""Parameters that loading loops identify: elasticity, and the elements of gears' hysteresis."""

from __future__ import annotations

from collections.abc import Collection, Mapping
from dataclasses import dataclass, replace

import numpy as np

from coupling.files.gear_table import sheet_elements
from coupling.identification.static.elastic import ElasticParameters
from coupling.robot.parameters import RobotParameter, robot_parameters, with_joints
from elastic_robot.description import Joint, Robot

# Slip torque at the start of a fit, over the range of the gear's torque in the loops.
_START = 0.1


@dataclass(frozen=True)
class LoopParameters(ElasticParameters):
    """The parameters p: those of `ElasticParameters`, then hysteresis of gears.

    `joint[i].hysteresis` is the torque at which all elements of a gear slip [N m].
    `joint[i].slip_angle`, of a gear that the file has without elements, is the largest slip angle [rad],
    to which the others are in proportion.
    """

    @classmethod
    def of_loops(
        cls, robot: Robot, torque_curve: str, shaped: Collection[int] = ()
    ) -> LoopParameters:
        """Return the parameters of a robot.

        Args:
            robot: The robot.
            torque_curve: A name of `TORQUE_CURVES`.
            shaped: Numbers of joints, from 0, whose slip angles are fitted as well.
        """
        own = robot_parameters(robot, torque_curve, ("stiffness", "backlash", "hysteresis"))
        angles = [
            replace(
                parameter,
                name=parameter.name.replace("hysteresis", "slip_angle"),
                kind="slip_angle",
                value=robot.joints[joint_of(parameter)].hysteresis[-1].slip_angle,
            )
            for parameter in own
            if parameter.kind == "hysteresis" and joint_of(parameter) in shaped
        ]
        return cls(robot, (*own, *angles))

    def chosen(self, kind: str) -> np.ndarray:
        """Return which parameters are of a kind, (P,)."""
        return np.array([own.kind == kind for own in self.own], dtype=bool)

    def together(self, j: int) -> np.ndarray:
        """Return which parameters stand and fall with one: a slip torque has its slip angle, (P,)."""
        own = self.own[j]
        with_it = [own.kind == "hysteresis" and p.coordinate == own.coordinate for p in self.own]
        mask = np.array(with_it) & self.chosen("slip_angle")
        mask[j] = True
        return mask

    def described(self, values: np.ndarray) -> Robot:
        """Return the robot with values of p, (P,)."""
        robot = super().described(values)
        angles = np.maximum(values, self.least)[self.chosen("slip_angle")].tolist()
        joints = [joint_of(own) for own in self.own if own.kind == "slip_angle"]
        shaped = {i: _shaped(robot.joints[i], own) for i, own in zip(joints, angles, strict=True)}
        return with_joints(robot, shaped)


def joint_of(parameter: RobotParameter) -> int:
    """Return the number of a parameter's joint, from 0."""
    return int(parameter.name.partition("]")[0].removeprefix("joint[")) - 1


def with_elements(robot: Robot, ranges: Mapping[int, float]) -> Robot:
    """Return the robot with elements for gears that have none, three as a data sheet's loop has them.

    Args:
        robot: The robot.
        ranges: Ranges of gears' torques [N m] by their joints' numbers, from 0.
    """

    def given(own: Joint, largest: float) -> Joint:
        assert own.stiffness is not None
        lost = 2.0 * _START * largest / own.stiffness
        return replace(own, hysteresis=sheet_elements(lost, own.stiffness))

    return with_joints(robot, {i: given(robot.joints[i], own) for i, own in ranges.items()})


def without_elements(robot: Robot, joints: Collection[int]) -> Robot:
    """Return the robot with gears that have no hysteresis, by their joints' numbers, from 0."""
    return with_joints(robot, {i: replace(robot.joints[i], hysteresis=()) for i in joints})


def _shaped(own: Joint, largest: float) -> Joint:
    factor = largest / own.hysteresis[-1].slip_angle
    stops = (replace(stop, slip_angle=factor * stop.slip_angle) for stop in own.hysteresis)
    return replace(own, hysteresis=tuple(stops))
