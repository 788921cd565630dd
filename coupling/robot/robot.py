"""What the desk asks of robots, whether it is one or a cell of several."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Protocol

import numpy as np

from coupling.path.histories import JointPath, ToolPath, WrenchHistory
from elastic_robot.fmi.interface import Mode


@dataclass(frozen=True)
class RateWarning:
    """A joint is asked to move faster than it can.

    Attributes:
        joint: Number, from 1.
        time: Instant at which it is worst [s].
        rate: Rate there [rad/s].
        limit: Maximum rate of the joint [rad/s].
        robot: Name of the robot in a cell of several.
    """

    joint: int
    time: float
    rate: float
    limit: float
    robot: str = ""

    def __str__(self) -> str:
        whose = f"{self.robot}: " if self.robot else ""
        return (
            f"{whose}joint {self.joint} moves at {self.rate:.3g} rad/s at t = {self.time:.3f} s;"
            f" its maximum rate is {self.limit:.3g} rad/s"
        )


class SimulatedRobot(Protocol):
    """What the coupling needs of a robot."""

    def simulate(self, command: JointPath, wrench: WrenchHistory, mode: Mode) -> ToolPath:
        """Return the paths that the TCPs take.

        Raises:
            SimulationError: If the robot cannot be simulated.
        """
        ...


class Robot(SimulatedRobot, Protocol):
    """What a correction needs of a robot."""

    def plan(self, path: ToolPath) -> JointPath:
        """Return the joint angles of the undeflected robot along the paths of its tools.

        Raises:
            PlanningError: If it cannot follow.
        """
        ...

    def forward(self, joints: JointPath, time: np.ndarray) -> ToolPath:
        """Return the paths of the undeflected tools under a motion of the drives.

        Args:
            joints: The motion.
            time: Rising, within the motion [s], (k,).
        """
        ...
