"""Measurements of robots, made by MuJoCo: springs, play, gravity, loads and points off the TCP."""

from __future__ import annotations

from dataclasses import replace

import mujoco
import numpy as np
import pinocchio as pin

from coupling.identify.measurements import Measurements
from elastic_robot.description import Robot
from examples.mujoco_robot.elastic_model import ElasticModel
from examples.mujoco_robot.integrators import INTEGRATORS
from examples.mujoco_robot.multibody import TCP
from examples.mujoco_robot.rest import settle


def with_tcp_at(robot: Robot, point: np.ndarray) -> Robot:
    """The robot with its TCP at a point of its TCP frame."""
    turn = pin.rpy.rpyToMatrix(*robot.tcp_rpy)
    place = np.array(robot.tcp_position) + turn @ point
    return replace(robot, tcp_position=tuple(place.tolist()))


def measured(
    robot: Robot,
    q: np.ndarray,
    wrench: np.ndarray,
    load_point: np.ndarray,
    measured_point: np.ndarray,
    rotations: bool = True,
) -> Measurements:
    """What MuJoCo says happens, (k, 3) or (k, 6); each row with its own points in the TCP's frame."""
    rows = []
    for angles, load, at, point in zip(q, wrench, load_point, measured_point, strict=True):
        model = ElasticModel(
            with_tcp_at(robot, at), "backlash", INTEGRATORS["RK4"], 1e-3, wrench_axes=range(6)
        )
        before, after = (_point(model, angles, w, point - at) for w in (np.zeros(6), load))
        turn = np.empty(3)
        quaternion = np.empty(4)
        mujoco.mju_mat2Quat(quaternion, (after[1] @ before[1].T).ravel())
        mujoco.mju_quat2Vel(turn, quaternion, 1.0)
        rows.append(np.append(after[0] - before[0], turn)[: 6 if rotations else 3])
    return Measurements.of(q, wrench, np.array(rows), load_point, measured_point)


def _point(model: ElasticModel, q: np.ndarray, wrench: np.ndarray, arm: np.ndarray):
    settle(model, q, wrench)
    site = model.data.site(TCP)
    turn = site.xmat.reshape(3, 3).copy()
    return site.xpos + turn @ arm, turn
