"""What is to be made: the desired path of the tools and what a process may know of it."""

from __future__ import annotations

import tempfile
from abc import ABC, abstractmethod
from dataclasses import dataclass, field
from pathlib import Path
from uuid import uuid4

from coupling.events import Watch, unwatched
from coupling.files.toml_file import Schema
from coupling.path.histories import ToolPath
from coupling.toolpaths.part import Part
from coupling.toolpaths.support import Support


def _temporary_folder() -> Path:
    return Path(tempfile.gettempdir(), f"elastic_robot_{uuid4().hex}")


@dataclass(frozen=True)
class Task:
    """What is to be made.

    Attributes:
        part: Placement of the part.
        forming: Desired path of the tool; in a cell, of the forming tool.
        wall_angle: Angle of the wall from the sheet's plane [rad], or None where the path has none.
        step_down: Distance between two contours [m], or None.
        support: Task of the supporting tool of a cell, or None.
        workspace: Folder for files that a process leaves; a new temporary one unless given.
        watch: Function that is told what happens in an evaluation.
    """

    part: Part
    forming: ToolPath
    wall_angle: float | None = None
    step_down: float | None = None
    support: Support | None = None
    workspace: Path = field(default_factory=_temporary_folder)
    watch: Watch = unwatched

    @property
    def desired(self) -> ToolPath:
        """Desired paths of all tools, forming tool first."""
        if self.support is None:
            return self.forming
        return ToolPath.of_tools([self.forming, self.support.desired])


class ToolPathTable(Schema, ABC):
    """Base of the case file's tool paths; a table answers `path(part)`, and `task(part)` from it."""

    @abstractmethod
    def path(self, part: Part) -> ToolPath:
        """Return the tool path in the robot's base frame."""

    def task(self, part: Part) -> Task:
        """Return what is to be made along the path."""
        return Task(part, self.path(part))
