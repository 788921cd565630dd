"""A robot that is nothing but springs: what closed forms of the coupling are made for."""

import numpy as np

from coupling.path.histories import ToolPath, WrenchHistory
from coupling.path.joint_path import JointPath
from elastic_robot.fmi.interface import Mode


def upright(points: np.ndarray) -> np.ndarray:
    """Return poses without rotation."""
    return np.hstack([points, np.tile([0.0, 0.0, 0.0, 1.0], (len(points), 1))])


def drives(command: JointPath, time: np.ndarray) -> np.ndarray:
    """Return the drives' angles at given times, (n, joints); those of the rows as they are."""
    if np.array_equal(time, command.time):
        return command.q[0]
    return command.trajectory.at(time)[0]


class SpringRobot:
    """A tool on springs: position = commanded position + compliance force.  The drives are x, y, z."""

    def __init__(self, compliance: np.ndarray) -> None:
        self.compliance = compliance  # (3, 3) or (n, 3, 3) [m/N]

    def simulate(self, command: JointPath, wrench: WrenchHistory, mode: Mode) -> ToolPath:
        free = drives(command, wrench.time)
        give = np.einsum("...ij,...j->...i", self.compliance, wrench.force[0])
        if wrench.spring is None:
            return ToolPath(wrench.time, upright(free + give))
        # x = free + C (F + K (a - x))
        spring = wrench.spring
        pull = self.compliance @ spring.stiffness[0]
        whole = free + give + (pull @ spring.anchor[0][..., None])[..., 0]
        resting = np.linalg.solve(np.eye(3) + pull, whole[..., None])[..., 0]
        return ToolPath(wrench.time, upright(resting))


class SpringPlanner:
    """Its kinematics."""

    def plan(self, path: ToolPath) -> JointPath:
        return JointPath(path.time, (path.position[0],))

    def forward(self, joints: JointPath, time: np.ndarray) -> ToolPath:
        return ToolPath(time, upright(drives(joints, time)))
