"""A robot file with fitted values: what was fitted, how sure it is, and why the rest was kept."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from types import MappingProxyType

import numpy as np

from coupling.errors import IdentifyError
from coupling.files.robot_file import axes_of_file, load_robot
from coupling.identification.verdict import Named, ParameterVerdict
from coupling.robot.parameters import place_of
from coupling.robot.robot_edit import RobotEdit
from elastic_robot.description import Robot

# What [sources] says of values by the command that has fitted them.
_SAYS = {"identify": "identified", "learn": "learned"}


@dataclass(frozen=True)
class FileEntry:
    """A parameter in a robot file.

    Attributes:
        name: Name in the FMU.
        value: New value, in the file's unit; None: as in the start file.
        remark: Comment beside it.
        added: Whether the start file lacks its tilt, or its gear's elements of hysteresis.
        interval: Its 95 % interval, in the file's unit; what is not finite and positive bounds nothing.
    """

    name: str
    value: float | None
    remark: str
    added: bool = False
    interval: tuple[float | None, float | None] = (None, None)

    @property
    def bounds(self) -> tuple[float, float] | None:
        """Its 95 % interval where both ends are known, finite and positive."""
        low, high = self.interval
        if low is None or high is None or not 0.0 < low <= high < np.inf:
            return None
        return low, high


def entries_of(
    verdicts: Iterable[ParameterVerdict[Named]], written: Mapping[str, float] = MappingProxyType({})
) -> list[FileEntry]:
    """Return the entries of fitted parameters: values of those that are identifiable, all remarks.

    Args:
        verdicts: Verdicts on them.
        written: Values to write where they are not the fitted ones, by name, in the file's unit.
    """
    return [
        FileEntry(
            verdict.name,
            written.get(verdict.name, verdict.value) if verdict.identifiable else None,
            verdict.remark,
            interval=(verdict.low, verdict.high),
        )
        for verdict in verdicts
    ]


def require_written(refusal: str, target: Path) -> None:
    """Raise if a fit refuses to be written.

    Raises:
        IdentifyError: With the file and the refusal, if that is not empty.
    """
    if refusal:
        raise IdentifyError(f"{target}: not written: {refusal}")


def fitted_text(
    start: Path,
    robot: Robot,
    entries: Sequence[FileEntry],
    command: str,
    measured: str,
    residuals: str,
    target: Path,
) -> str:
    """Return the start file with fitted values.

    Args:
        start: The start file.
        robot: The robot with these values.
        entries: Its parameters.
        command: Command that has fitted them, a key of `_SAYS`.
        measured: Kind and source of the measurement.
        residuals: Residuals of the fit, in words.
        target: Place of the new file.

    Raises:
        RobotFileError: If the start file cannot be read.
    """
    file, source = RobotEdit(start, load_robot(start)), f"{_SAYS[command]}, {measured}"
    for entry in entries:
        joint, tilt, _ = place_of(entry.name)
        if entry.added and tilt:
            new = robot.joints[joint - 1].tilt[tilt - 1]
            axis = np.round(axes_of_file(start)[joint - 1].T @ new.axis, 15) + 0.0
            table = {"axis": axis.tolist(), "stiffness": entry.value, "damping": new.damping}
            sources = {
                "axis": "tested by elastic-robot identify",
                "damping": "same ratio to the stiffness as of the joint itself",
            }
            file.add_tilt(joint, table, sources)
        if entry.added and entry.name.endswith(".hysteresis"):
            file.add_elements(joint, robot.joints[joint - 1].hysteresis)
        if entry.value is not None:
            file.change(entry.name, entry.value, source, entry.bounds)
        file.remark(entry.name, entry.remark)
    kept_names = [entry.name for entry in entries if entry.value is None]
    outcome = "All identified."
    if kept_names:
        outcome = f"Not identified, as in {start.name}: {', '.join(kept_names)}."
    head = f"Made from {start.name} by elastic-robot {command}: {measured}.\n{residuals}\n{outcome}"
    return file.text(head, target)
