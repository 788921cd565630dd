"""A robot file with fitted values: what was fitted, how sure it is, and why the rest was kept."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import Generic, TypeVar

import numpy as np

from coupling.errors import IdentifyError
from coupling.files.robot_file import axes_of_file, load_robot
from coupling.results.parameter_result import FitResult
from coupling.robot.parameters import place_of
from coupling.robot.robot_edit import RobotEdit
from elastic_robot.description import Robot

# What [sources] says of values by the command that has fitted them.
_SAYS = {"identify": "identified", "learn": "learned"}


Fit = TypeVar("Fit")
Figures = TypeVar("Figures", bound=FitResult)


@dataclass(frozen=True)
class Identification(Generic[Fit, Figures]):
    """What a measurement identifies of a robot.

    Attributes:
        fit: The fit behind it.
        robot: The robot as written.
        result: The figures.
        residuals: Residuals in words, for the head of the robot file.
        remarks: Words behind the parameters' own remarks, by name.
        command: Command that has fitted it, a key of `_SAYS`.
    """

    fit: Fit
    robot: Robot
    result: Figures
    residuals: str
    remarks: Mapping[str, str] = field(default_factory=dict)
    command: str = "identify"

    def text(self, start: Path, measured: str, target: Path) -> str:
        """Return the start file with the identified values; what no file has is passed over.

        Args:
            start: The start file.
            measured: Kind and source of the measurement.
            target: Place of the new file.

        Raises:
            IdentifyError: If it is refused.
            RobotFileError: If the start file cannot be read.
        """
        if self.result.refusal:
            raise IdentifyError(f"{target}: not written: {self.result.refusal}")
        file = RobotEdit(start, load_robot(start))
        source, robot = f"{_SAYS[self.command]}, {measured}", self.robot
        parameters = [
            p
            for p in self.result.parameters
            if p.written is not None and (p.identified or not p.added) and p.kind != "slip_angle"
        ]
        for parameter in parameters:
            joint, tilt, kind = place_of(parameter.name)
            if parameter.added and tilt:
                new = robot.joints[joint - 1].tilt[tilt - 1]
                axis = np.round(axes_of_file(start)[joint - 1].T @ new.axis, 15) + 0.0
                table = {
                    "axis": axis.tolist(),
                    "stiffness": parameter.written,
                    "damping": new.damping,
                }
                sources = {
                    "axis": "tested by elastic-robot identify",
                    "damping": "same ratio to the stiffness as of the joint itself",
                }
                file.add_tilt(joint, table, sources)
            if parameter.added and kind == "hysteresis":
                file.add_elements(joint, robot.joints[joint - 1].hysteresis)
            if parameter.is_written and parameter.written is not None:
                file.change(parameter.name, parameter.written, source, parameter.bounds)
            file.remark(parameter.name, parameter.remark + self.remarks.get(parameter.name, ""))
        kept_names = [parameter.name for parameter in parameters if not parameter.is_written]
        outcome = "All identified."
        if kept_names:
            outcome = f"Not identified, as in {start.name}: {', '.join(kept_names)}."
        head = f"Made from {start.name} by elastic-robot {self.command}: {measured}."
        return file.text(f"{head}\n{self.residuals}\n{outcome}", target)
