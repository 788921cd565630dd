"""What a robot's FMU takes and gives: names, rows of a wrench history, the files of drives and robot."""

from __future__ import annotations

from pathlib import Path
from typing import BinaryIO

import numpy as np

from coupling.files.csv_table import STIFFNESS_COLUMNS
from coupling.native.robot_text import robot_text
from coupling.path.histories import WrenchHistory
from coupling.path.joint_path import JointPath
from elastic_robot.description import Robot
from elastic_robot.fmi.variables import AXES, POSE

# The wrench and its rate; a contact spring's anchor, its velocity and the stiffness; the TCP's pose.
WRENCH_INPUTS = tuple(
    f"{name}.{axis}" for name in ("force", "moment", "force_rate", "moment_rate") for axis in AXES
)
SPRING_INPUTS = tuple(f"anchor.{name}" for name in (*AXES, "vx", "vy", "vz", *STIFFNESS_COLUMNS))
POSE_OUTPUTS = tuple(f"tcp.{name}" for name in POSE)
# Behind the native robot's own lines follow those of the FMU's variables, which stay.
_ROBOT_TEXT_END = "\nend\n"
NATIVE, PYTHON = "resources/robot.txt", "resources/robot.json"


def save_trajectory(file: Path | BinaryIO, command: JointPath) -> None:
    """Write the motion of one robot as an NPZ that the FMU's `trajectory` reads."""
    columns = {"time": command.time, **command.columns}
    np.savez(file, columns=list(columns), data=np.column_stack(list(columns.values())))


def input_rows(wrench: WrenchHistory, part: slice) -> np.ndarray:
    """Return the inputs for some steps in SI units, (n, names), a spring's where there is one.

    In the order of their names; the first row is for initialisation [N, N m, N/s, N m/s, m, m/s, N/m].
    """
    (before,), (behind,) = wrench.before[:, part], wrench.behind[:, part]
    steps = np.diff(wrench.instants[part])[:, None]
    start, rate = before.copy(), np.zeros_like(before)
    start[1:], rate[1:] = behind[:-1], (before[1:] - behind[:-1]) / steps
    loads = np.hstack([start, rate])
    if wrench.spring is None:
        return loads
    (anchor,), (stiffness,) = wrench.spring.anchor[:, part], wrench.spring.entries[:, part]
    place, velocity = anchor.copy(), np.zeros_like(anchor)
    place[1:], velocity[1:] = anchor[:-1], np.diff(anchor, axis=0) / steps
    return np.hstack([loads, place, velocity, stiffness])


def rows_with_spring(wrench: WrenchHistory) -> np.ndarray:
    """Return the inputs for all steps, (n, 24); a spring that is not there has 0 [m, m/s, N/m]."""
    rows = input_rows(wrench, slice(None))
    count = 0 if wrench.spring is not None else len(SPRING_INPUTS)
    return np.hstack([rows, np.zeros((len(rows), count))])


class UnpackedRobot:
    """The robot of an unpacked FMU, whose kind is "native" or "python"."""

    def __init__(self, folder: Path) -> None:
        self._native, self._python = folder / NATIVE, folder / PYTHON
        self.kind = "native" if self._native.is_file() else "python"
        self._original = ""
        self._robot: Robot | None = None

    def describe(self, robot: Robot | None) -> None:
        """Let instances that are made from now on be of a robot.

        Args:
            robot: The robot, with as many joints, tilts, gears' elements and motors as the FMU's; None:
                the FMU's.

        Raises:
            RobotFileError: If it is larger than a native FMU holds.
        """
        if robot == self._robot:
            return
        file = self._native if self.kind == "native" else self._python
        self._original = self._original or file.read_text(encoding="utf-8")
        file.write_text(self._text(robot), encoding="utf-8")
        self._robot = robot

    def _text(self, robot: Robot | None) -> str:
        if robot is None:
            return self._original
        if self.kind == "python":
            return robot.to_json()
        lines, variables = self._original.split(_ROBOT_TEXT_END, maxsplit=1)
        guid = lines.splitlines()[1].split(maxsplit=1)[1]
        return f"{robot_text(robot, guid)}\n{variables}"
