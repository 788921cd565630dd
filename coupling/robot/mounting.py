"""A robot as a case holds it: on a base that may be turned, with a TCP that may be moved."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
from scipy.spatial.transform import Rotation

from coupling.path.frame import Frame
from elastic_robot.description import Robot


@dataclass(frozen=True)
class Mounting:
    """Changes of a robot's description by its case.

    Attributes:
        base: world_from_base, of which the robot file knows nothing: its gravity is that of a base that
            is not turned.
        tcp_shift: Shift of the TCP on the tool, tool axes [m], (3,).

    Example:
        >>> from coupling.files.robot_file import find_robot, load_robot
        >>> robot = load_robot(find_robot("icme2008"))
        >>> hanging = Mounting(Rotation.from_euler("x", 180.0, degrees=True), np.zeros(3))
        >>> [round(g, 6) + 0.0 for g in hanging.of(robot).gravity]
        [0.0, 0.0, 9.81]
    """

    base: Rotation
    tcp_shift: np.ndarray

    def of(self, robot: Robot) -> Robot:
        """Return the robot, all in axes of its base."""
        changed = robot
        if self.base.magnitude() > 0.0:
            gravity = self.base.inv().apply(robot.gravity)
            changed = replace(changed, gravity=tuple(gravity.tolist()))
        if self.tcp_shift.any():
            tcp = Frame.of_rpy(robot.tcp_position, robot.tcp_rpy).points(self.tcp_shift)
            changed = replace(changed, tcp_position=tuple(tcp.tolist()))
        return changed


AS_DESCRIBED = Mounting(Rotation.identity(), np.zeros(3))
