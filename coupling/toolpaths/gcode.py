"""A tool path from CAM: G-code."""

from __future__ import annotations

from dataclasses import replace
from functools import cached_property
from typing import Annotated, Literal

import numpy as np
from pydantic import Field

from coupling.files.toml_file import FilePath, Positive
from coupling.path.frame import Frame
from coupling.toolpaths.gcode_moves import GcodeMove, GcodeProgram
from coupling.toolpaths.gcode_program import read_program
from coupling.toolpaths.instants import NONE, Corners, PathTimes
from coupling.toolpaths.motion import require_few
from coupling.toolpaths.part import tool_path
from coupling.toolpaths.remarks import counted
from coupling.toolpaths.segments import Chain
from coupling.toolpaths.table import ToolPathTable
from coupling.toolpaths.task import Task
from coupling.toolpaths.travel import Travel
from coupling.toolpaths.untilted import UntiltedPath


class GcodePath(ToolPathTable):
    """Moves of a G-code program, whose coordinates are those of the TCP in the part frame.

    Keys: file; rapid_m_s, speed of G0; corner_deg, the turn from which on the tool rests between two
    moves; blend_s of starts and stops, sample_s.
    """

    kind: Literal["gcode"]
    file: FilePath
    rapid_m_s: Positive = 0.1
    corner_deg: Annotated[float, Field(ge=0.0, le=90.0)] = 10.0
    blend_s: Positive = 0.2
    sample_s: Positive = 0.02

    @cached_property
    def _program(self) -> GcodeProgram:
        return read_program(self.file)

    def task(
        self, part: Frame, corners: Corners = NONE, untilted: UntiltedPath | None = None
    ) -> Task:
        """Return the task, with remarks on words without effect, assumptions and jumps."""
        words = counted(self._program.ignored)
        remarks = [f"{self.file.name}: read and left out: {words}"] if words else []
        remarks += [f"{self.file.name}: {sentence}" for sentence in self._program.assumptions]
        if jump := self._jump():
            remarks.append(
                f"{self.file.name}: where lines and arcs meet without a rest, the acceleration jumps, by"
                f" up to {jump:.3g} m/s^2 at the feed"
            )
        return replace(super().task(part, corners, untilted), remarks=tuple(remarks))

    def _jump(self) -> float:
        """Return the largest jump of the acceleration where moves meet without a rest.

        At a speed v it is v^2 times the change of the curvature vector, v^2/r from a line to an arc.
        """
        moves, stops, _ = self._steps
        curvatures = np.array([move.curvatures for move in moves])
        change = np.linalg.norm(curvatures[1:, 0] - curvatures[:-1, 1], axis=1)
        feed = self._feeds
        jumps = np.minimum(feed[1:], feed[:-1]) ** 2 * change
        return float(np.max(jumps, initial=0.0, where=~stops[:-1]))

    def untilted(self, part: Frame, corners: Corners = NONE) -> UntiltedPath:
        """Return the tool path in the world before the tool is turned.

        Raises:
            CaseError: If the file is unreadable or not such a program, or takes too long.
        """
        moves, stops, waits = self._steps
        curve = Chain([move.segment for move in moves])
        travel = Travel.along(curve.lengths, self._feeds, self.blend_s, stops, waits)
        require_few(float(travel.rests[-1]) / self.sample_s, self.file)
        instants = PathTimes.of(travel.rests, self.sample_s, corners)
        path = tool_path(part, instants.time, curve.point(travel.at(instants.time)))
        return self._headed(UntiltedPath(part, path, instants.sample_rows))

    @property
    def _feeds(self) -> np.ndarray:
        """Speeds of the moves [m/s], (n,)."""
        speeds = [self.rapid_m_s if move.feed is None else move.feed for move in self._steps[0]]
        return np.array(speeds)

    @cached_property
    def _steps(self) -> tuple[list[GcodeMove], np.ndarray, np.ndarray]:
        """Moves, whether the tool rests behind each, and how long it waits there [s], (n,).

        It rests where it waits, in a corner, and between a rapid and a feed.
        """
        moves: list[GcodeMove] = []
        waits: dict[int, float] = {}
        for step in self._program.steps:
            if isinstance(step, GcodeMove):
                moves.append(step)
            elif moves:
                last = len(moves) - 1
                waits[last] = waits.get(last, 0.0) + step.duration
        begins, ends = (
            np.array([getattr(move, name) for move in moves]) for name in ("begins", "ends")
        )
        rapid = np.array([move.feed is None for move in moves])
        smooth = np.cos(np.deg2rad(self.corner_deg))
        corner = np.einsum("ij,ij->i", begins[1:], ends[:-1]) < smooth
        stops = np.append(corner | (rapid[1:] != rapid[:-1]), True)
        wait = np.zeros(len(moves))
        for number, duration in waits.items():
            stops[number], wait[number] = True, duration
        return moves, stops, wait
