"""What is to be exported of a command, and what was."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from coupling.errors import ProgramError, one_of
from coupling.path.deviation import Deviation
from coupling.programs.languages import Language, Targets
from coupling.programs.program import ProgramFile, RobotProgram
from coupling.results.drive_result import DriveMotion
from coupling.results.export_result import NearestSingularity

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
        points_tolerance: Smallest tolerance of its points along the command [m].
        candidates: Number of points that a program with one on every cycle has.
        loss: Largest distance between the tool of the moving robot under the files and under the
            command [m].
        loss_on_joint_lines: The same if the drives go straight from set point to set point; None where
            the controller's motion is a spline through the targets.
        command, read_back: Deviation from the desired path under the command, and under the files; None
            where a command came without a desired path.
        counted: Whether the robot file says how the controller counts.
        advice: Option that would keep the tolerance, where it is not kept, or empty.
    """

    robot: str
    program: RobotProgram
    files: tuple[ProgramFile, ...]
    points_tolerance: float
    candidates: int
    loss: float
    command: Deviation | None
    read_back: Deviation | None
    drives: tuple[DriveMotion, ...]
    nearest: NearestSingularity
    counted: bool
    remark: str = ""
    loss_on_joint_lines: float | None = None
    advice: str = ""

    @property
    def points(self) -> int:
        """Number of targets of the path."""
        return len(self.program.timed)

    @property
    def bytes(self) -> int:
        """Size of the files."""
        return sum(len(file.text.encode()) for file in self.files)

    @property
    def shortest(self) -> float:
        """Shortest time between two targets [s]."""
        return float(self._times.min())

    @property
    def median(self) -> float:
        """Median time between two targets [s]."""
        return float(np.median(self._times))

    @property
    def share_of_shortest(self) -> float:
        """Share of the times between two targets that are the shortest."""
        return float(np.mean(self._times < self.shortest + _ONE_TIME))

    @property
    def _times(self) -> np.ndarray:
        return np.array([move.duration for move in self.program.timed[1:]], dtype=float)
