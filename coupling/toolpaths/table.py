"""Keys that every tool path of the case file has."""

from __future__ import annotations

from abc import ABC, abstractmethod
from typing import Annotated, Literal

import numpy as np
from pydantic import Field

from coupling.errors import CaseError
from coupling.files.toml_file import Schema
from coupling.path.frame import Frame
from coupling.path.histories import ToolPath
from coupling.toolpaths.feed import headings_along
from coupling.toolpaths.instants import NO_CORNERS, Corners
from coupling.toolpaths.task import Task
from coupling.toolpaths.tilt import ToolTilt
from coupling.toolpaths.untilted import UntiltedPath

# A tool's tilt: it comes from above.
Tilt = Annotated[float, Field(gt=-90.0, lt=90.0)]
# Highest rate at which a path may turn its tool [rad/s].
MAX_TURN_RATE = np.pi


class ToolPathTable(Schema, ABC):
    """Base of the case file's tool paths; a table answers `untilted(part)`, and all else follows.

    Keys: lead_deg and lean_deg tilt the tool, rotation_deg turns it about its own axis before.
    tilt_frame says what the tilt is measured from: "part", the part's axes, lead about y and lean
    about x, or "path", feed and normal of the path, lead forward and lean to the right.
    """

    tilt_frame: Literal["part", "path"] = "part"
    lead_deg: Tilt = 0.0
    lean_deg: Tilt = 0.0
    rotation_deg: Annotated[float, Field(ge=-360.0, le=360.0)] = 0.0

    @abstractmethod
    def untilted(self, part: Frame, corners: Corners = NO_CORNERS) -> UntiltedPath:
        """Return the tool path in the world before the tool is turned.

        Args:
            part: base_from_part.
            corners: Times at which the process is to be evaluated as well [s].

        Raises:
            CaseError: If there is none, or tilts are measured from a feed that it does not have.
        """

    def _with_headings(self, untilted: UntiltedPath) -> UntiltedPath:
        """Return a path as a file gives it, with its feed where the tilt is measured from it."""
        if self.tilt_frame == "part":
            return untilted
        return untilted.headed(headings_along(untilted.path))

    @property
    def untilted_lean_deg(self) -> float:
        """Lean of the untilted tool [deg]; other than 0 along an inclined wall."""
        return 0.0

    @property
    def tilt(self) -> ToolTilt:
        """Tilt of the tool."""
        lean = self.lean_deg - self.untilted_lean_deg
        return ToolTilt(*np.deg2rad([self.lead_deg, lean, self.rotation_deg]).tolist())

    def path(self, part: Frame) -> ToolPath:
        """Return the path of the tool's tip in the world.

        Raises:
            CaseError: As for `untilted`, or if the tool is turned too fast along it.
        """
        return self._tilt_path(self.untilted(part))

    def _tilt_path(self, untilted: UntiltedPath) -> ToolPath:
        path = untilted.tilted(self.tilt)
        if self.tilt_frame == "path":
            _require_slow_turns(path)
        return path

    def task(
        self, part: Frame, corners: Corners = NO_CORNERS, untilted: UntiltedPath | None = None
    ) -> Task:
        """Return the task along the path, its TCP being the tool's tip.

        Args:
            part: base_from_part.
            corners: Times at which the process is to be evaluated as well [s].
            untilted: The path before the tool is turned, where it is known already.
        """
        untilted = untilted or self.untilted(part, corners)
        return Task(part, self._tilt_path(untilted), sample_rows=untilted.sample_rows)


def _require_slow_turns(path: ToolPath) -> None:
    (rotations,) = path.rotations
    rate = (rotations[1:] * rotations[:-1].inv()).magnitude() / np.diff(path.time)
    if rate.max() > MAX_TURN_RATE:
        k = int(np.argmax(rate))
        raise CaseError(
            "tool_path: tilt_frame: expected a path that turns its tool by at most"
            f" {np.rad2deg(MAX_TURN_RATE):.0f} deg/s, got {np.rad2deg(rate[k]):.4g} deg/s at"
            f" {path.time[k]:.4g} s: let it rest in its corners for longer, or tilt it less"
        )
