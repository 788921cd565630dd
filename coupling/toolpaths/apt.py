"""A tool path from CAM: cutter locations with the tool's axis."""

from __future__ import annotations

import math
from dataclasses import replace
from functools import cached_property
from typing import Annotated, Literal

import numpy as np
from pydantic import Field

from coupling.errors import CaseError
from coupling.files.toml_file import FilePath, Positive
from coupling.path.frame import Frame
from coupling.toolpaths.apt_program import AptProgram, read_program
from coupling.toolpaths.instants import NONE, Corners
from coupling.toolpaths.oriented_points import SAME, OrientedPoints, PathLaw
from coupling.toolpaths.part import upright
from coupling.toolpaths.remarks import counted
from coupling.toolpaths.table import ToolPathTable
from coupling.toolpaths.task import Task
from coupling.toolpaths.untilted import UntiltedPath


class AptPath(ToolPathTable):
    """Points of APT cutter location data, whose coordinates are those of the TCP in the part frame.

    Keys: file; rapid_m_s, speed of a RAPID; max_turn_deg_s, largest rate at which the tool turns;
    corner_deg, blend_s, sample_s as for G-code.  The TCP's axis of approach is opposite to the tool axis
    of the file.
    """

    kind: Literal["apt"]
    file: FilePath
    rapid_m_s: Positive = 0.1
    corner_deg: Annotated[float, Field(ge=0.0, le=90.0)] = 10.0
    max_turn_deg_s: Positive = 180.0
    blend_s: Positive = 0.2
    sample_s: Annotated[float, Field(ge=1e-5)] = 0.02

    @cached_property
    def _program(self) -> AptProgram:
        return read_program(self.file)

    def task(
        self, part: Frame, corners: Corners = NONE, untilted: UntiltedPath | None = None
    ) -> Task:
        """Return the task, with remarks on statements left out and on what was assumed."""
        name, program = self.file.name, self._program
        remarks = [f"{name}: {sentence}" for sentence in program.assumptions]
        if program.left_out:
            remarks.append(f"{name}: read and left out: {counted(program.left_out)}")
        return replace(super().task(part, corners, untilted), remarks=tuple(remarks))

    def untilted(self, part: Frame, corners: Corners = NONE) -> UntiltedPath:
        """Return the tool path in the world before the tool is turned.

        Raises:
            CaseError: If the file is unreadable or not such data, or takes too long.
        """
        law = PathLaw(
            float(np.deg2rad(self.corner_deg)),
            self.blend_s,
            float(np.deg2rad(self.max_turn_deg_s)),
            self.sample_s,
        )
        return self._headed(self._points().untilted(part, law, self.file, corners))

    def _points(self) -> OrientedPoints:
        """Return the points, at rest where it waits and where a rapid and a feed meet."""
        program = self._program
        kept = [0]
        rows = np.hstack([program.position, program.axis]).tolist()
        for number, row in enumerate(rows):
            if math.dist(row, rows[kept[-1]]) > SAME:
                kept.append(number)
        if len(kept) < 2:
            raise CaseError(f"{self.file}: expected GOTO from one point to another, got none")
        rapid = np.isnan(program.feed[kept])
        waits = np.add.reduceat(program.waits, kept)
        rests = waits > 0.0
        rests[1:-1] |= rapid[2:] != rapid[1:-1]
        try:
            rotation = upright(program.axis[kept])
        except ValueError as cause:
            raise CaseError(f"{self.file}: {cause}") from cause
        feed = np.where(rapid, self.rapid_m_s, program.feed[kept])
        return OrientedPoints(program.position[kept], rotation, feed, rests, waits)
