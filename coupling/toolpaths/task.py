"""Task of a process: the desired path of the tools and what the process may know of it."""

from __future__ import annotations

import tempfile
from dataclasses import dataclass, field, replace
from pathlib import Path
from uuid import uuid4

import numpy as np

from coupling.events import Watch, unwatched
from coupling.path.frame import Frame
from coupling.path.histories import ToolPath
from coupling.path.interpolation import SampledPath
from coupling.toolpaths.spindle import ProgrammedSpindle
from coupling.toolpaths.support import SupportingTool
from coupling.toolpaths.tilt import APPROACH


def _temporary_folder() -> Path:
    return Path(tempfile.gettempdir(), f"elastic_robot_{uuid4().hex}")


@dataclass(frozen=True)
class Task:
    """Tool path, part and process task.

    Attributes:
        part: base_from_part.
        forming: Desired path of the tool; in a cell, of the forming tool.
        sample_rows: Row numbers of it at which a process is evaluated, (k,); all of them unless given.
        wall_angle: Angle of the wall from the sheet's plane [rad], or None where the path has none.
        step_down: Distance between two contours [m], or None.
        support: Task of the supporting tool of a cell, or None.
        contact: Position of the TCP from the centre of the sphere that the forming tool ends in, tool
            axes, over its radius [1], (3,).  The TCP is the sphere's lowest point, so this is the
            untilted tool's approach; zero where the TCP is the centre, as the tool turns along its path.
        height: Height of the TCP above that lowest point, along the part's z axis [m].
        workspace: Folder for files that a process leaves; a new temporary one unless given.
        watch: Function called with what happens in an evaluation.
        remarks: Remarks on the tool path for the user, sentences.
        spindle: Speed of the spindle that a program has; None where it has none.
    """

    part: Frame
    forming: ToolPath
    wall_angle: float | None = None
    step_down: float | None = None
    support: SupportingTool | None = None
    contact: np.ndarray = field(default_factory=APPROACH.copy)
    height: float = 0.0
    sample_rows: np.ndarray = field(default_factory=lambda: np.zeros(0, dtype=int))
    workspace: Path = field(default_factory=_temporary_folder)
    watch: Watch = unwatched
    remarks: tuple[str, ...] = ()
    spindle: ProgrammedSpindle | None = None

    def __post_init__(self) -> None:
        if len(self.sample_rows) == 0:
            object.__setattr__(self, "sample_rows", np.arange(len(self.forming.time)))

    @property
    def sampled(self) -> Task:
        """The task at the times at which the process is evaluated."""
        return replace(
            self,
            forming=self.forming.at_rows(self.sample_rows),
            support=None if self.support is None else self.support.at_rows(self.sample_rows),
            sample_rows=np.arange(len(self.sample_rows)),
        )

    @property
    def motion(self) -> SampledPath:
        """Desired paths of all tools, with the rows at which a process is evaluated."""
        return SampledPath(self.desired, self.sample_rows)

    @property
    def desired(self) -> ToolPath:
        """Desired paths of all tools, forming tool first."""
        if self.support is None:
            return self.forming
        return ToolPath.of_tools([self.forming, self.support.desired])
