"""Postures over the part: the tool at the places of a grid about a path, held as on it."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from coupling.inverse.joint_limits import JointLimits
from coupling.path.frame import Frame
from coupling.path.histories import ToolPath
from coupling.robot.batch.following import Targets, solve_poses
from coupling.robot.batch.rigid_robot import RigidRobot
from elastic_robot.description import Robot

# Smallest distance from the middle to a side [m].
_HALF = 0.1
# Part of its longer side that a path which is a line is widened by to each side.
_WIDENED = 1.0 / 3.0


@dataclass(frozen=True)
class PartGrid:
    """Postures over the part, in its x-y plane.

    Attributes:
        x, y: Places in the part frame [m], (a,) and (b,).
        q: Joint angles [rad], NaN where the robot cannot be, (b, a, joints).
    """

    x: np.ndarray
    y: np.ndarray
    q: np.ndarray

    @classmethod
    def around(
        cls, robot: Robot, part: Frame, path: ToolPath, q: np.ndarray, points: int
    ) -> PartGrid:
        """Return the postures about a path.

        Args:
            q: Joint angles along it [rad], (n, joints).
        """
        where = part.coordinates(path.position[0])
        low, high = where[:, :2].min(axis=0), where[:, :2].max(axis=0)
        middle, half = 0.5 * (low + high), 0.5 * (high - low)
        half = np.maximum(half, max(_HALF, _WIDENED * float(half.max())))
        x, y = (middle[k] + half[k] * np.linspace(-1.0, 1.0, points) for k in range(2))
        across, along = np.meshgrid(x, y)
        lowest = np.full(across.size, where[:, 2].min())
        places = np.column_stack([across.ravel(), along.ravel(), lowest])
        near = np.linalg.norm(where[None, :, :2] - places[:, None, :2], axis=2).argmin(axis=1)
        posture = np.full((len(places), len(robot.joints)), np.nan)
        rotation = path.rotations[0][near].as_matrix().transpose(1, 2, 0)
        columns = [np.ascontiguousarray(rotation[:, k]) for k in range(3)]
        targets = Targets(part.points(places).T, columns, np.zeros((3, len(places))))
        angles, is_reached = solve_poses(RigidRobot(robot), targets, q[near].T)
        limits = JointLimits.of(robot)
        is_reached &= np.all(
            (angles >= limits.lower[:, None]) & (angles <= limits.upper[:, None]), axis=0
        )
        posture[is_reached] = angles.T[is_reached]
        return cls(x, y, posture.reshape(points, points, -1))
