"""A robot that is nothing but springs: what closed forms of the coupling are made for."""

from __future__ import annotations

import numpy as np

from coupling.path.histories import JointPath, ToolPath, WrenchHistory
from elastic_robot.fmi.interface import Mode


def upright(points: np.ndarray) -> np.ndarray:
    """Return poses without rotation."""
    return np.hstack([points, np.tile([0.0, 0.0, 0.0, 1.0], (len(points), 1))])


class SpringRobot:
    """A tool on springs: position = commanded position + compliance force.  The drives are x, y, z."""

    def __init__(self, compliance: np.ndarray) -> None:
        self.compliance = compliance  # (3, 3) or (n, 3, 3) [m/N]

    def simulate(self, command: JointPath, wrench: WrenchHistory, mode: Mode) -> ToolPath:
        give = np.einsum("...ij,...j->...i", self.compliance, wrench.force[0])
        return ToolPath(command.time, upright(command.q[0] + give))


class SpringPlanner:
    """Its inverse kinematics."""

    def plan(self, path: ToolPath) -> JointPath:
        return JointPath(path.time, (path.position[0],))
