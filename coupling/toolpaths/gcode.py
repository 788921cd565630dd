"""A tool path from CAM: G-code."""

from __future__ import annotations

from functools import cached_property
from typing import Literal

from coupling.files.toml_file import Positive
from coupling.toolpaths.cam_path import CamPath
from coupling.toolpaths.gcode_course import GcodeCourse
from coupling.toolpaths.gcode_moves import GcodeProgram
from coupling.toolpaths.gcode_program import read_program
from coupling.toolpaths.roll import ROLLS
from coupling.toolpaths.rotary import RotaryTable
from coupling.toolpaths.spindle import ProgrammedSpindle

_UNITS = {"mm": 1e-3, "inch": 0.0254}  # [m]


class GcodePath(CamPath):
    """Moves of a G-code program, whose coordinates are those of the TCP in the part frame.

    Keys: file; unit, that of a program without G20 or G21 before its first length; rapid_m_s, speed of
    G0; corner_deg, the turn from which on the tool rests between two moves; blend_s of starts and stops,
    sample_s; rotary, a table of the machine's rotary axes; max_turn_deg_s, largest rate at which the
    tool turns; roll, its rotation about its axis, as for APT.
    """

    kind: Literal["gcode"]
    unit: Literal["mm", "inch"] | None = None
    rapid_m_s: Positive = 0.1
    sample_s: Positive = 0.02
    roll: Literal["upright", "parallel"] = "upright"
    rotary: RotaryTable | None = None

    @cached_property
    def _program(self) -> GcodeProgram:
        return read_program(
            self.file, self.rotary, None if self.unit is None else _UNITS[self.unit]
        )

    def _spindle(self) -> ProgrammedSpindle | None:
        return self._program.spindle

    def _plan(self) -> GcodeCourse:
        kinematics = None if self.rotary is None else self.rotary.kinematics
        return GcodeCourse(self._program, kinematics, self.rapid_m_s, ROLLS[self.roll])
