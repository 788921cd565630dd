"""A tool path from CAM: G-code."""

from __future__ import annotations

from dataclasses import replace
from functools import cached_property
from typing import Annotated, Literal

import numpy as np
from pydantic import Field

from coupling.errors import CaseError
from coupling.files.toml_file import FilePath, Positive
from coupling.path.frame import Frame
from coupling.path.histories import ToolPath, poses
from coupling.toolpaths.gcode_course import Course, CourseLaw
from coupling.toolpaths.gcode_moves import GcodeProgram
from coupling.toolpaths.gcode_program import read_program
from coupling.toolpaths.instants import NO_CORNERS, Corners, PathTimes
from coupling.toolpaths.motion import require_few
from coupling.toolpaths.oriented_points import TURN_JUMP
from coupling.toolpaths.remarks import format_counts
from coupling.toolpaths.roll import ROLLS
from coupling.toolpaths.rotary import RotaryTable
from coupling.toolpaths.table import ToolPathTable
from coupling.toolpaths.task import Task
from coupling.toolpaths.travel import Travel
from coupling.toolpaths.untilted import UntiltedPath

_UNITS = {"mm": 1e-3, "inch": 0.0254}  # [m]


class GcodePath(ToolPathTable):
    """Moves of a G-code program, whose coordinates are those of the TCP in the part frame.

    Keys: file; unit, that of a program without G20 or G21 before its first length; rapid_m_s, speed of
    G0; corner_deg, the turn from which on the tool rests between two moves; blend_s of starts and stops,
    sample_s; rotary, a table of the machine's rotary axes; max_turn_deg_s, largest rate at which the
    tool turns; roll, its rotation about its axis, as for APT.
    """

    kind: Literal["gcode"]
    file: FilePath
    unit: Literal["mm", "inch"] | None = None
    rapid_m_s: Positive = 0.1
    corner_deg: Annotated[float, Field(ge=0.0, le=90.0)] = 10.0
    max_turn_deg_s: Positive = 180.0
    blend_s: Positive = 0.2
    sample_s: Positive = 0.02
    roll: Literal["upright", "parallel"] = "upright"
    rotary: RotaryTable | None = None

    @cached_property
    def _program(self) -> GcodeProgram:
        return read_program(
            self.file, self.rotary, None if self.unit is None else _UNITS[self.unit]
        )

    @cached_property
    def _course(self) -> Course:
        kinematics = None if self.rotary is None else self.rotary.kinematics
        try:
            return Course(self._program, kinematics)
        except ValueError as cause:
            raise CaseError(f"{self.file}: {cause}") from cause

    @cached_property
    def _law(self) -> CourseLaw:
        corner, turn = np.deg2rad([self.corner_deg, self.max_turn_deg_s]).tolist()
        return CourseLaw(self.rapid_m_s, corner, turn)

    def task(
        self, part: Frame, corners: Corners = NO_CORNERS, untilted: UntiltedPath | None = None
    ) -> Task:
        """Return the task, with remarks on words without effect, assumptions and jumps."""
        words = format_counts(self._program.ignored)
        remarks = [f"{self.file.name}: read and left out: {words}"] if words else []
        remarks += [f"{self.file.name}: {sentence}" for sentence in self._program.assumptions]
        if jump := self._course.jump(*self._passed):
            remarks.append(
                f"{self.file.name}: where lines and arcs meet without a rest, the acceleration jumps, by"
                f" up to {jump:.3g} m/s^2 at the feed"
            )
        if (turn_jump := np.rad2deg(self._course.turn_jump(*self._passed))) > TURN_JUMP:
            remarks.append(
                f"{self.file.name}: where moves are passed without a rest, the tool's angular velocity"
                f" jumps, by up to {turn_jump:.3g} deg/s"
            )
        task = super().task(part, corners, untilted)
        return replace(task, remarks=tuple(remarks), spindle=self._program.spindle)

    @cached_property
    def _passed(self) -> tuple[np.ndarray, np.ndarray]:
        """Whether the tool rests behind each move, and the speeds of the moves [m/s or rad/s], (n,)."""
        return self._course.stops(self._law), self._course.feeds(self._law)

    def untilted(self, part: Frame, corners: Corners = NO_CORNERS) -> UntiltedPath:
        """Return the tool path in the world before the tool is turned.

        Raises:
            CaseError: If the file is unreadable or not such a program, or takes too long.
        """
        course, (stops, feeds) = self._course, self._passed
        travel = Travel.along(course.lengths, feeds, self.blend_s, stops, course.waits)
        require_few(float(travel.rests[-1]) / self.sample_s, self.file)
        instants = PathTimes.of(travel.rests, self.sample_s, corners)
        points, axes = course.points(travel.at(instants.time))
        if (plane := self._program.plane) is not None:
            points, axes = plane.points(points), plane.rotate(axes)
        try:
            tool = ROLLS[self.roll](axes)
        except ValueError as cause:
            raise CaseError(f"{self.file}: {cause}") from cause
        path = ToolPath(instants.time, poses(points, tool)).transformed(part)
        return self._with_headings(UntiltedPath(part, path, instants.sample_rows))
