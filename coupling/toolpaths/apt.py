"""A tool path from CAM: cutter locations with the tool's axis."""

from __future__ import annotations

import math
from functools import cached_property
from typing import Literal

import numpy as np

from coupling.files.toml_file import Positive
from coupling.toolpaths.apt_program import AptProgram, read_program
from coupling.toolpaths.cam_path import CamPath
from coupling.toolpaths.oriented_points import POINT_TOLERANCE, OrientedPoints
from coupling.toolpaths.roll import ROLLS
from coupling.toolpaths.spindle import ProgrammedSpindle


class AptPath(CamPath):
    """Points of APT cutter location data, whose coordinates are those of the TCP in the part frame.

    Keys: file; rapid_m_s, speed of a RAPID; roll, how the tool is rotated about its axis;
    max_turn_deg_s, largest rate at which the tool turns; corner_deg, blend_s, sample_s as for G-code.
    The TCP's axis of approach is opposite to the tool axis of the file.
    """

    kind: Literal["apt"]
    rapid_m_s: Positive = 0.1
    roll: Literal["upright", "parallel"] = "upright"

    @cached_property
    def _program(self) -> AptProgram:
        return read_program(self.file)

    def _spindle(self) -> ProgrammedSpindle | None:
        return self._program.spindle

    def _plan(self) -> OrientedPoints:
        """Return the points, at rest where it waits and where a rapid and a feed meet."""
        program = self._program
        distinct_rows = [0]
        rows = np.hstack([program.position, program.axis]).tolist()
        for number, row in enumerate(rows):
            if math.dist(row, rows[distinct_rows[-1]]) > POINT_TOLERANCE:
                distinct_rows.append(number)
        if len(distinct_rows) < 2:
            raise ValueError("expected GOTO from one point to another, got none")
        rapid = np.isnan(program.feed[distinct_rows])
        waits = np.add.reduceat(program.waits, distinct_rows)
        rests = waits > 0.0
        rests[1:-1] |= rapid[2:] != rapid[1:-1]
        rotation = ROLLS[self.roll](program.axis[distinct_rows])
        feed = np.where(rapid, self.rapid_m_s, program.feed[distinct_rows])
        return OrientedPoints(program.position[distinct_rows], rotation, feed, rests, waits[1:])
