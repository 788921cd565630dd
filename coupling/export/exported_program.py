"""What is to be exported of a command, and what was."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from coupling.errors import ProgramError, one_of
from coupling.programs.languages import Language, Targets
from coupling.programs.program import ProgramFile, RobotProgram
from coupling.results.export_result import ExportedProgramResult

# Largest loss by the export at the tool of the moving robot [m].
TOLERANCE = 5e-6
# Times this close are one [s].
_ONE_TIME = 1e-6


@dataclass(frozen=True)
class ExportOptions:
    """What is to be written.

    Attributes:
        name: Name of the program; None for that of the run folder or table.
        cycle: Period of the controller's set points [s]; None for the command's.
        shortest: Least time between targets [s]; None for the language's, or less where the tolerance
            takes that.
    """

    language: Language
    targets: Targets
    name: str | None = None
    tolerance: float = TOLERANCE
    cycle: float | None = None
    shortest: float | None = None

    def __post_init__(self) -> None:
        if self.targets not in self.language.targets:
            text = one_of(self.language.targets, self.targets)
            raise ProgramError(f"--targets: {self.language.name}: {text}")
        if not (np.isfinite(self.tolerance) and self.tolerance > 0.0):
            raise ProgramError(
                f"--tolerance: expected a number > 0 [um], got {self.tolerance * 1e6:g}"
            )
        if self.language.dense and self.shortest is not None:
            raise ProgramError(
                f"--shortest-ms: {self.language.name}: expected none, as it has a row on every cycle:"
                " give --cycle-ms"
            )
        if self.shortest is not None and not (np.isfinite(self.shortest) and self.shortest > 0.0):
            raise ProgramError(
                f"--shortest-ms: expected a number > 0 [ms], got {self.shortest * 1e3:g}"
            )

    @property
    def spacing(self) -> float:
        """Least time between targets that is tried first [s]."""
        return self.language.shortest if self.shortest is None else self.shortest


@dataclass(frozen=True)
class ExportedProgram:
    """The program of one robot, and what its files do.

    Attributes:
        advice: Option that would keep the tolerance, where it is not kept, or empty.
    """

    program: RobotProgram
    files: tuple[ProgramFile, ...]
    figures: ExportedProgramResult
    remark: str = ""
    advice: str = ""

    @property
    def share_of_shortest(self) -> float:
        """Share of the times between two targets that are the shortest."""
        shortest = self.figures.shortest_time_s
        return float(np.mean(times_between(self.program) < shortest + _ONE_TIME))


def times_between(program: RobotProgram) -> np.ndarray:
    """Return the times between the targets of a program [s], (n,)."""
    return np.array([move.duration for move in program.timed[1:]], dtype=float)
