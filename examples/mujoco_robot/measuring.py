"""What a robot in MuJoCo deflects by under loads: measurements for elastic-robot identify."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import mujoco
import numpy as np
import pinocchio as pin

from elastic_robot.coupling.identification.static.measurements import Measurements
from elastic_robot.description import Robot
from examples.mujoco_robot.elastic_model import ElasticModel
from examples.mujoco_robot.integrators import INTEGRATORS
from examples.mujoco_robot.multibody import TCP
from examples.mujoco_robot.rest import settle


def measured(
    robot: Robot,
    q: np.ndarray,
    wrench: np.ndarray,
    points: Sequence[np.ndarray],
    rotations: bool = False,
) -> Measurements:
    """Let a robot settle without and with a load, by MuJoCo's forces alone, and compare.

    Args:
        robot: The robot; gears with backlash.
        q: Drive angles [rad], (k, n).
        wrench: Loads, base axes [N, N m], (k, 6).
        points: Where they act and what is measured, in the TCP's frame [m], (k, 3) each.
        rotations: Whether rotations are measured as well.
    """
    rows = []
    for angles, load, at, point in zip(q, wrench, *points, strict=True):
        model = ElasticModel(
            _with_tcp_at(robot, at), "backlash", INTEGRATORS["RK4"], 1e-3, wrench_axes=range(6)
        )
        before, after = (_point(model, angles, w, point - at) for w in (np.zeros(6), load))
        turn, quaternion = np.empty(3), np.empty(4)
        mujoco.mju_mat2Quat(quaternion, (after[1] @ before[1].T).ravel())
        mujoco.mju_quat2Vel(turn, quaternion, 1.0)
        rows.append(np.append(after[0] - before[0], turn)[: 6 if rotations else 3])
    return Measurements.of(q, wrench, np.array(rows), *points)


def _point(
    model: ElasticModel, q: np.ndarray, wrench: np.ndarray, arm: np.ndarray
) -> tuple[np.ndarray, np.ndarray]:
    """Return place and axes of a point of the tool at rest, `arm` [m] from the TCP in its frame."""
    settle(model, q, wrench)
    site = model.data.site(TCP)
    axes = site.xmat.reshape(3, 3).copy()
    return site.xpos + axes @ arm, axes


def _with_tcp_at(robot: Robot, point: np.ndarray) -> Robot:
    """Return the robot with its TCP at a point of its TCP frame."""
    turn = pin.rpy.rpyToMatrix(*robot.tcp_rpy)
    place = np.array(robot.tcp_position) + turn @ point
    return replace(robot, tcp_position=tuple(place.tolist()))
