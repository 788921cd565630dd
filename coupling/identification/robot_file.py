"""A robot file with fitted values: what was fitted, how sure it is, and why the rest was kept."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from coupling.files.robot_edit import RobotEdit, place_of
from coupling.files.robot_file import axes_of_file
from elastic_robot.description import Robot


@dataclass(frozen=True)
class FileEntry:
    """A parameter in a robot file.

    Attributes:
        name: Name in the FMU.
        value: New value, in the file's unit; None: as in the start file.
        remark: Comment beside it.
        added: Whether the start file lacks its tilt, or its gear's elements of hysteresis.
    """

    name: str
    value: float | None
    remark: str
    added: bool = False


def fitted_text(
    start: Path, robot: Robot, entries: Iterable[FileEntry], source: str, head: str, target: Path
) -> str:
    """Return the start file with fitted values.

    Args:
        start: The start file.
        robot: The robot with these values.
        entries: Its parameters.
        source: What [sources] says of new values.
        head: Comment at its beginning.
        target: Place of the new file.

    Raises:
        RobotFileError: If the start file cannot be read.
    """
    file = RobotEdit(start, robot)
    for entry in entries:
        joint, tilt = place_of(entry.name)
        if entry.added and tilt:
            new = robot.joints[joint - 1].tilt[tilt - 1]
            axis = np.round(axes_of_file(start)[joint - 1].T @ new.axis, 15) + 0.0
            table = {"axis": axis.tolist(), "stiffness": entry.value, "damping": new.damping}
            sources = {
                "axis": "tested by elastic-robot identify",
                "damping": "the ratio to the stiffness that the joint itself has",
            }
            file.add_tilt(joint, table, sources)
        if entry.added and entry.name.endswith(".hysteresis"):
            file.add_elements(joint, robot.joints[joint - 1].hysteresis)
        if entry.value is not None:
            file.change(entry.name, entry.value, source)
        file.remark(entry.name, entry.remark)
    return file.text(head, target)
