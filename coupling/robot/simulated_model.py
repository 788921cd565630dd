"""A robot with what simulates it, and robots that differ from it."""

from __future__ import annotations

from dataclasses import dataclass, replace

from coupling.errors import SimulationError
from coupling.path.histories import ToolPath, WrenchHistory
from coupling.path.joint_path import JointPath
from coupling.robot.contract import Advance
from coupling.robot.differences import RobotDifference
from coupling.robot.robot_fmu import RobotFmu
from elastic_robot.description import Robot
from elastic_robot.fmi.interface import IDEAL, Mode


@dataclass(frozen=True)
class SimulatedModel:
    """A robot with the FMU that simulates it, which may be that of one with other numbers.

    Attributes:
        what: Differences of it from the FMU's robot, in words.
    """

    robot: Robot
    torque_curve: str
    fmu: RobotFmu
    drive: str = IDEAL
    what: str = ""

    def differing(self, difference: RobotDifference, what: str) -> SimulatedModel:
        """Return the model of a robot that differs, in words; it has the same `robot` if nothing shows.

        Raises:
            SimulationError: If no robot has such numbers.
        """
        try:
            robot = difference.applied(self.robot, self.torque_curve, self.drive)
        except ValueError as cause:
            raise SimulationError(str(cause)) from cause
        return replace(self, robot=robot, what=what)

    def simulate(self, command: JointPath, wrench: WrenchHistory, mode: Mode) -> ToolPath:
        """Return the path that the TCP takes."""
        return self.fmu.simulate(command, wrench, mode, self.robot, self.what)

    def march(self, command: JointPath, start: WrenchHistory, end: float, mode: Mode) -> Advance:
        """Begin a simulation that goes on window by window, as `RobotFmu.march`."""
        return self.fmu.march(command, start, end, mode, self.robot)
