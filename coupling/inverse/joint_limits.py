"""Limits of the drives of a robot, as arrays."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from coupling.inverse.drive_limits import DriveLimits
from elastic_robot.description import Robot


@dataclass(frozen=True)
class JointLimits:
    """Limits of the drives, one entry a joint; infinite where there is none.

    Attributes:
        lower, upper: Lowest and highest angle [rad], (joints,).
        rate: Highest rate [rad/s], (joints,).
        acceleration: Highest acceleration [rad/s^2], (joints,).
    """

    lower: np.ndarray
    upper: np.ndarray
    rate: np.ndarray
    acceleration: np.ndarray

    @classmethod
    def of(cls, robot: Robot, max_acceleration: float | None = None) -> JointLimits:
        """Return the limits of a robot's joints.

        Args:
            max_acceleration: Highest acceleration of any joint [rad/s^2], which lowers the joints'
                own; None leaves these.

        Example:
            >>> from elastic_robot.body import Body
            >>> from elastic_robot.description import Joint
            >>> link = Body(mass=1.0, com=(0.0, 0.0, 0.0), inertia=(0.1, 0.1, 0.1))
            >>> joint = Joint((0.0, 0.0, 0.0), (0.0, 0.0, 1.0), link, limits=(-1.0, 2.0))
            >>> limits = JointLimits.of(Robot("arm", (joint,)), max_acceleration=5.0)
            >>> limits.upper, limits.rate, limits.acceleration
            (array([2.]), array([inf]), array([5.]))
        """
        ranges = [joint.limits or (-np.inf, np.inf) for joint in robot.joints]
        lower, upper = np.array(ranges, dtype=float).T
        return cls(
            lower,
            upper,
            np.array([joint.max_rate or np.inf for joint in robot.joints]),
            np.minimum(
                [joint.max_acceleration or np.inf for joint in robot.joints],
                max_acceleration or np.inf,
            ),
        )

    def of_joint(self, joint: int) -> DriveLimits:
        """Return the limits of one joint, by its number from 0."""
        return DriveLimits(
            joint + 1,
            float(self.lower[joint]),
            float(self.upper[joint]),
            float(self.rate[joint]),
            float(self.acceleration[joint]),
        )
