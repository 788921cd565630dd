"""Elements of hysteresis that gears are given, and what loading loops do to these gears."""

from __future__ import annotations

from collections.abc import Collection, Mapping
from dataclasses import replace

import numpy as np

from coupling.files.gear_table import sheet_elements
from coupling.identification.static.measurements import Measurements
from coupling.identification.static.prediction import RigidPostures
from coupling.robot.parameters import with_joints
from elastic_robot.description import Joint, Robot

# A gear's load turns back where its way, over all loads of a loop, is longer than its range by this
# part of that; and counts where its range is this part of the largest one.
_TURNED, _LOADED = 0.2, 1e-3
# Slip torque at the start of a fit, over the range of the gear's torque in the loops.
_START = 0.1


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


def reversed_ranges(robot: Robot, measured: Measurements) -> np.ndarray:
    """Return the range of each elastic coordinate's torque [N m], 0 where no loop turns it back, (m,).

    In the posture of the rigid robot.
    """
    by_load, ranges, largest = RigidPostures.of(robot, measured).torque_by_load(measured), [], 0.0
    for rows in measured.sequences:
        torque = np.vstack([np.zeros_like(by_load[0]), by_load[rows]])
        whole, way = np.ptp(torque, axis=0), np.abs(np.diff(torque, axis=0)).sum(axis=0)
        largest = max(largest, float(whole.max(initial=0.0)))
        ranges.append(np.where(way - whole > _TURNED * whole, whole, 0.0))
    widest: np.ndarray = np.max(ranges, axis=0)
    return np.where(widest > _LOADED * largest, widest, 0.0)
