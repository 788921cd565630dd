"""What is to be made: the desired path of the tools and what a process may know of it."""

from __future__ import annotations

import tempfile
from abc import ABC, abstractmethod
from dataclasses import dataclass, field
from pathlib import Path
from typing import Annotated
from uuid import uuid4

import numpy as np
from pydantic import Field

from coupling.events import Watch, unwatched
from coupling.files.toml_file import Schema
from coupling.path.histories import ToolPath
from coupling.toolpaths.part import Part
from coupling.toolpaths.support import Support
from coupling.toolpaths.tilt import APPROACH, ToolTilt

# A tool's tilt: it comes from above.
Tilt = Annotated[float, Field(gt=-90.0, lt=90.0)]


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
        contact: Where the TCP is on the sphere that the forming tool ends in, seen from its centre: unit
            vector in the tool's axes, (3,).  The TCP is the sphere's lowest point, so this is the tool's
            approach where it stands upright.
        workspace: Folder for files that a process leaves; a new temporary one unless given.
        watch: Function that is told what happens in an evaluation.
        remarks: What the user should know of the tool path, sentences.
    """

    part: Part
    forming: ToolPath
    wall_angle: float | None = None
    step_down: float | None = None
    support: Support | None = None
    contact: np.ndarray = field(default_factory=APPROACH.copy)
    workspace: Path = field(default_factory=_temporary_folder)
    watch: Watch = unwatched
    remarks: tuple[str, ...] = ()

    @property
    def desired(self) -> ToolPath:
        """Desired paths of all tools, forming tool first."""
        if self.support is None:
            return self.forming
        return ToolPath.of_tools([self.forming, self.support.desired])


class ToolPathTable(Schema, ABC):
    """Base of the case file's tool paths; a table answers `upright(part)`, and all else follows.

    Keys: lead_deg and lean_deg turn the tool about the part's y and x axes, rotation_deg about its own
    axis before.
    """

    lead_deg: Tilt = 0.0
    lean_deg: Tilt = 0.0
    rotation_deg: Annotated[float, Field(ge=-360.0, le=360.0)] = 0.0

    @abstractmethod
    def upright(self, part: Part) -> ToolPath:
        """Return the tool path in the world before the tool is turned."""

    @property
    def tilt(self) -> ToolTilt:
        """How the tool is turned."""
        return ToolTilt(*np.deg2rad([self.lead_deg, self.lean_deg, self.rotation_deg]).tolist())

    def path(self, part: Part) -> ToolPath:
        """Return the tool path in the world."""
        return self.tilt.path(part, self.upright(part))

    def task(self, part: Part) -> Task:
        """Return what is to be made along the path."""
        return Task(part, self.path(part))
