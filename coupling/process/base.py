"""What a process model is, and what it may know of its task."""

from __future__ import annotations

import tempfile
from collections.abc import Callable
from dataclasses import dataclass, field
from pathlib import Path
from typing import Protocol, Self, runtime_checkable
from uuid import uuid4

from coupling.path.histories import ToolPath, WrenchHistory
from coupling.toolpaths.part import Part

# Folder in the workspace for what programs compute; kept even where a run fails.
EVALUATIONS = "evaluations"


class Process(Protocol):
    """A process model."""

    def wrench(self, path: ToolPath) -> WrenchHistory:
        """Return the wrench on the tool along an actual path, base axes.

        What there is to look at besides, such as a formed sheet, is the history's `workpiece`.
        """
        ...


# Called with the work done and in all, in whatever unit the process counts.
Progress = Callable[[int, int], None]


def silent(done: int, total: int) -> None:
    """Show no progress."""


@runtime_checkable
class Watchable(Process, Protocol):
    """A process that takes longer than a second: it can tell how far it is."""

    def watched(self, progress: Progress) -> Self:
        """Return the same process, telling its progress."""
        ...


def _temporary_folder() -> Path:
    return Path(tempfile.gettempdir(), f"elastic_robot_{uuid4().hex}")


@dataclass(frozen=True)
class Task:
    """What is to be made.

    Attributes:
        part: Placement of the part.
        desired: Tool path that would make it.
        wall_angle: Of the wall from the sheet's plane [rad], or None where the path has none.
        step_down: Between two contours [m], or None.
        workspace: Folder for files that a process leaves; a new temporary one unless given.
    """

    part: Part
    desired: ToolPath
    wall_angle: float | None = None
    step_down: float | None = None
    workspace: Path = field(default_factory=_temporary_folder)
