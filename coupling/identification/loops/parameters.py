"""Parameters of a robot whose gears have memory, and what loading loops do to its gears."""

from __future__ import annotations

from collections.abc import Collection, Mapping
from dataclasses import dataclass, replace

import numpy as np

from coupling.files.gear_table import sheet_elements
from coupling.identification.static.elastic import KINDS_AT_REST, ElasticParameters
from coupling.identification.static.measurements import Measurements
from coupling.identification.static.prediction import jacobian_at
from coupling.robot.parameters import RobotParameter, place_of, robot_parameters, with_joints
from elastic_robot.chain import build_chain
from elastic_robot.description import Joint, Robot
from elastic_robot.kinematics import base_from_tool, tcp_jacobian

# A gear's load turns back where its way, over all loads of a loop, is longer than its range by this
# part of that; and counts where its range is this part of the largest one.
_TURNED, _LOADED = 0.2, 1e-3
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
            torque_curve: A name of `TORQUE_CURVES`.
            shaped: Numbers of joints, from 0, whose slip angles are fitted as well.
        """
        every = robot_parameters(robot, torque_curve, KINDS_AT_REST)
        return cls(
            robot, tuple(p for p in every if p.kind != "slip_angle" or joint_of(p) in shaped)
        )

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


def joint_of(parameter: RobotParameter) -> int:
    """Return the number of a parameter's joint, from 0."""
    return place_of(parameter.name)[0] - 1


def with_elements(robot: Robot, ranges: Mapping[int, float]) -> Robot:
    """Return the robot with elements for gears that have none, three as a data sheet's loop has them.

    Args:
        ranges: Ranges of gears' torques [N m] by their joints' numbers, from 0.
    """

    def add_elements(joint: Joint, largest: float) -> Joint:
        assert joint.stiffness is not None
        lost = 2.0 * _START * largest / joint.stiffness
        return replace(joint, hysteresis=sheet_elements(lost, joint.stiffness))

    return with_joints(
        robot,
        {i: add_elements(robot.joints[i], torque_range) for i, torque_range in ranges.items()},
    )


def without_elements(robot: Robot, joints: Collection[int]) -> Robot:
    """Return the robot with gears that have no hysteresis, by their joints' numbers, from 0."""
    return with_joints(robot, {i: replace(robot.joints[i], hysteresis=()) for i in joints})


def loop_rows(measured: Measurements) -> list[np.ndarray]:
    """Return the indices of the rows of each loop, in their order, (rows,) each."""
    assert measured.loop is not None
    numbers, first = np.unique(measured.loop, return_index=True)
    return [np.flatnonzero(measured.loop == n) for n in numbers[np.argsort(first)]]


def reversed_ranges(robot: Robot, measured: Measurements) -> np.ndarray:
    """Return the range of each elastic coordinate's torque [N m], 0 where no loop turns it back, (m,).

    In the posture of the rigid robot.
    """
    chain = build_chain(robot)
    data, ranges, largest = chain.model.createData(), [], 0.0
    for rows in loop_rows(measured):
        theta = chain.theta(measured.q[rows[0]])
        turn = base_from_tool(chain, data, theta).rotation
        jacobian = tcp_jacobian(chain, data, theta)[:, chain.elastic]
        loads = np.vstack([np.zeros(6), measured.wrench[rows]])
        torque = loads @ jacobian_at(jacobian, turn @ measured.load_point[rows[0]])
        whole, way = np.ptp(torque, axis=0), np.abs(np.diff(torque, axis=0)).sum(axis=0)
        largest = max(largest, float(whole.max(initial=0.0)))
        ranges.append(np.where(way - whole > _TURNED * whole, whole, 0.0))
    widest: np.ndarray = np.max(ranges, axis=0)
    return np.where(widest > _LOADED * largest, widest, 0.0)
