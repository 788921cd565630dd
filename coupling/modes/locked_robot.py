"""A robot that is held in a posture under a wrench, its motors locked, and linearised there."""

from __future__ import annotations

import numpy as np

from coupling.errors import StabilityError
from elastic_robot.description import Robot
from elastic_robot.errors import ElasticRobotError
from elastic_robot.linearisation import Linearisation
from elastic_robot.robot import ElasticRobot
from elastic_robot.tool_load import Load
from elastic_robot.trajectory import HeldCommand

# A gear with less of its stiffness is inside its backlash, where gravity alone holds it.
_FREE = 0.02


class LockedRobot:
    """A robot whose motors are locked.

    Example:
        >>> from coupling.files.robot_file import find_robot, load_robot
        >>> locked = LockedRobot(load_robot(find_robot("icme2008")), "backlash")
        >>> linear = locked.linear(np.array([0, 0.2, 0.3, 0, 1, 0]), np.array([50.0, 50, 0, 5, 5, 5]))
        >>> linear.modes.frequency[:2].round(1)
        array([10.1, 10.2])
    """

    def __init__(self, robot: Robot, torque_curve: str) -> None:
        self.robot, self.torque_curve = robot, torque_curve
        self._elastic = ElasticRobot(robot, torque_curve)

    @property
    def joints(self) -> tuple[int, ...]:
        """Number of the joint of each elastic coordinate, from 1."""
        return tuple(int(joint) + 1 for joint in self._elastic.chain.elastic_joint)

    def unloaded_joints(self, linear: Linearisation) -> tuple[int, ...]:
        """Return the numbers, from 1, of joints whose gears are unloaded in their backlash."""
        is_free = np.diag(linear.stiffness) < _FREE * self._elastic.parameters.stiffness
        return tuple(dict.fromkeys(np.array(self.joints, dtype=int)[is_free].tolist()))

    def linear(self, q: np.ndarray, wrench: np.ndarray) -> Linearisation:
        """Return the robot linearised at its equilibrium.

        A gear with backlash that nothing loads has no stiffness; the wrench decides on its flank.

        Args:
            q: Angles of its drives [rad], (joints,).
            wrench: Wrench on the tool at the TCP, base axes [N, N m], (6,).

        Raises:
            StabilityError: If it has no equilibrium there.
        """
        none = np.zeros_like(q)
        try:
            self._elastic.reset(0.0, HeldCommand(0.0, q, none, none), Load(wrench))
            return self._elastic.linearise()
        except ElasticRobotError as cause:
            degrees = ", ".join(f"{angle:.4g}" for angle in np.rad2deg(q))
            raise StabilityError(
                f"robot {self.robot.name} at {degrees} deg under"
                f" {np.linalg.norm(wrench[:3]):.4g} N: {cause}"
            ) from cause
