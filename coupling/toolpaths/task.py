"""What is to be made: the desired path of the tools and what a process may know of it."""

from __future__ import annotations

import tempfile
from dataclasses import dataclass, field
from pathlib import Path
from uuid import uuid4

import numpy as np

from coupling.events import Watch, unwatched
from coupling.path.histories import ToolPath
from coupling.toolpaths.part import Part
from coupling.toolpaths.support import Support
from coupling.toolpaths.tilt import APPROACH


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
        contact: Where the TCP is on the sphere that the forming tool ends in, seen from its centre, in
            units of its radius and in the tool's axes, (3,).  The TCP is the sphere's lowest point, so
            this is the tool's approach where it stands upright; zero where the TCP is the centre,
            because the tool turns along its path.
        height: How far the TCP is above that lowest point, along the part's z axis [m].
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
    height: float = 0.0
    workspace: Path = field(default_factory=_temporary_folder)
    watch: Watch = unwatched
    remarks: tuple[str, ...] = ()

    @property
    def desired(self) -> ToolPath:
        """Desired paths of all tools, forming tool first."""
        if self.support is None:
            return self.forming
        return ToolPath.of_tools([self.forming, self.support.desired])
