"""The robot of an unpacked FMU, which instances read when they are made: another one is a text."""

from __future__ import annotations

from pathlib import Path

from coupling.native.robot_text import robot_text
from elastic_robot.description import Robot

# Behind the native robot's own lines follow those of the FMU's variables, which stay.
_ROBOT_TEXT_END = "\nend\n"
NATIVE, PYTHON = "resources/robot.txt", "resources/robot.json"


class UnpackedRobot:
    """The robot of an unpacked FMU of either kind.

    Args:
        folder: The unpacked FMU.
    """

    def __init__(self, folder: Path) -> None:
        self._native, self._python = folder / NATIVE, folder / PYTHON
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
        file = self._native if self._native.is_file() else self._python
        self._original = self._original or file.read_text(encoding="utf-8")
        file.write_text(self._text(robot), encoding="utf-8")
        self._robot = robot

    def _text(self, robot: Robot | None) -> str:
        if robot is None:
            return self._original
        if not self._native.is_file():
            return robot.to_json()
        lines, variables = self._original.split(_ROBOT_TEXT_END, maxsplit=1)
        guid = lines.splitlines()[1].split(maxsplit=1)[1]
        return f"{robot_text(robot, guid)}\n{variables}"
