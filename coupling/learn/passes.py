"""A measured pass: what the robot was told, what acted on it, and where its tool was seen."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
from scipy.interpolate import CubicSpline
from scipy.spatial.transform import Rotation, RotationSpline

from coupling.inverse.inversion import Wanted
from coupling.path.histories import JointPath, ToolPath, WrenchHistory
from coupling.robot.robot_fmu import RobotFmu


@dataclass(frozen=True)
class Seen:
    """What a measuring device tells.

    Attributes:
        name: Name of the file.
        time: Rising [s], (n,).
        position: Of the TCP [m], (n, 3).
        rotation: Of the tool; None where not measured.
    """

    name: str
    time: np.ndarray
    position: np.ndarray
    rotation: Rotation | None = None

    def at_rows(self, rows: np.ndarray) -> Seen:
        """Return some of its rows."""
        rotation = None if self.rotation is None else self.rotation[rows]
        return replace(self, time=self.time[rows], position=self.position[rows], rotation=rotation)


@dataclass(frozen=True)
class Pass:
    """A pass of a command, as far as it was measured.

    Attributes:
        command: Motion of the drives.
        wrench: Wrench on the tool, until the end of what was measured.
        desired: Desired path, at the same times.
        wanted: The same for the inverse, with the joint angles of the undeflected robot.
        seen: What was measured, in the robot's base frame as far as that is known, on the command's
            clock.
    """

    command: JointPath
    wrench: WrenchHistory
    desired: ToolPath
    wanted: Wanted
    seen: Seen

    def simulated(self, fmu: RobotFmu, changed: dict[str, float]) -> Simulated:
        """Return where the tool is on a robot with other parameters."""
        path = fmu.simulate(self.command, self.wrench, "dynamic", changed, "learned parameters")
        return Simulated(path)


class Simulated:
    """A simulated path between its samples.

    Args:
        path: The path of one tool.
    """

    def __init__(self, path: ToolPath) -> None:
        self._path = path
        self._position = CubicSpline(path.time, path.position[0])

    def position(self, time: np.ndarray, order: int = 0) -> np.ndarray:
        """Return positions [m] or their rates at times that may lie a little outside, (n, 3)."""
        inside = np.clip(time, self._path.time[0], self._path.time[-1])
        values: np.ndarray = self._position(inside, order)
        return values

    def rotation(self, time: np.ndarray) -> Rotation:
        """Return rotations base_from_tool."""
        inside = np.clip(time, self._path.time[0], self._path.time[-1])
        return RotationSpline(self._path.time, self._path.rotations[0])(inside)
