"""Inverse kinematics of a batch in the desk library: the posture nearest to the one begun with."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from coupling.native.desk_robot import DeskRobot, ReachRules
from coupling.robot.batch.following import Targets
from coupling.robot.batch.vectors import rotate_vector
from elastic_robot.description import Robot

# A pose is reached when position [m] and rotation [rad] agree to this: the last step squares it.
_POSE_TOLERANCE = 1e-8


@dataclass(frozen=True)
class DeskPoses:
    """Solves for the joint angles of a robot at poses, as `following.solve_poses`, in C."""

    rigid: DeskRobot

    @classmethod
    def of(cls, robot: Robot) -> DeskPoses:
        """Return what solves those of a robot, whose tilts are left out."""
        joints = tuple(replace(joint, tilt=()) for joint in robot.joints)
        return cls(DeskRobot(replace(robot, joints=joints)))

    def solve(
        self, targets: Targets, start: np.ndarray, iterations: int
    ) -> tuple[np.ndarray, np.ndarray]:
        """Return joint angles at poses by damped least squares, and whether each pose was reached.

        Args:
            start: Angles to begin with [rad], (joints, n).

        Returns:
            Joint angles [rad], (joints, n), and a mask, (n,).
        """
        rules = ReachRules.usual(_POSE_TOLERANCE, iterations)
        # The robot's TCP, where the tool is not turned about a shifted one.
        position = (targets.position - rotate_vector(targets.tool, targets.tcp_shift)).T
        reached = self.rigid.reach(rules, position, targets.quaternions, start.T)
        return np.ascontiguousarray(reached.theta.T), reached.error < _POSE_TOLERANCE
