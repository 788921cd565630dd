"""A tool path from CAM: G-code."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import replace
from functools import cached_property
from itertools import pairwise
from typing import Annotated, Literal

import numpy as np
from pydantic import Field

from coupling.files.toml_file import FilePath, Positive
from coupling.path.frame import Frame
from coupling.toolpaths.gcode_moves import Dwell, GcodeMove, GcodeProgram
from coupling.toolpaths.gcode_program import read_program
from coupling.toolpaths.instants import NONE, Corners, PathTimes
from coupling.toolpaths.motion import Leg, Motion, chain, drive, require_few, waiting
from coupling.toolpaths.part import tool_path
from coupling.toolpaths.remarks import counted
from coupling.toolpaths.table import ToolPathTable
from coupling.toolpaths.task import Task
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
        """Return the largest jump of the acceleration within the moves that are driven without a rest.

        At a feed v it is v^2 times the change of the curvature vector, v^2/r from a line to an arc.
        """
        return max(
            (
                (one.feed or self.rapid_m_s) ** 2
                * float(np.linalg.norm(other.curvatures[0] - one.curvatures[1]))
                for stretch in self._stretches()
                if not isinstance(stretch, Dwell)
                for one, other in pairwise(stretch)
            ),
            default=0.0,
        )

    def untilted(self, part: Frame, corners: Corners = NONE) -> UntiltedPath:
        """Return the tool path in the world before the tool is turned.

        Raises:
            CaseError: If the file is unreadable or not such a program, or takes too long.
        """
        motion = Motion(list(self._driven()))
        instants = PathTimes.of(motion.ends, self.sample_s, corners)
        path = tool_path(part, instants.time, motion.at(instants.time))
        return self._of_file(part, path, instants.sample_rows)

    def _driven(self) -> Iterator[Leg]:
        """Yield the motion of each stretch between two rests, and of waits behind the first."""
        count, here = 1.0, None
        for stretch in self._stretches():
            if isinstance(stretch, Dwell):
                count += stretch.duration / self.sample_s
                require_few(count, self.file)
                if stretch.duration > 0.0 and here is not None:
                    yield waiting(here, stretch.duration)
                continue
            curve = chain([move.segment for move in stretch])
            feed = stretch[0].feed or self.rapid_m_s
            count += (curve.length / feed + 2.0 * self.blend_s) / self.sample_s
            require_few(count, self.file)
            here = curve.point(np.array([curve.length]))[0]
            yield drive(curve, feed, self.blend_s)

    def _stretches(self) -> Iterator[list[GcodeMove] | Dwell]:
        """Yield waits, and moves that are driven without a rest: at one feed, without a corner."""
        smooth = np.cos(np.deg2rad(self.corner_deg))
        moves: list[GcodeMove] = []
        for step in self._program.steps:
            if isinstance(step, Dwell):
                if moves:
                    yield moves
                    moves = []
                yield step
                continue
            if moves and (step.feed != moves[-1].feed or step.begins @ moves[-1].ends < smooth):
                yield moves
                moves = []
            moves.append(step)
        if moves:
            yield moves
