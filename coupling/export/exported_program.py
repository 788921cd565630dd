"""What is to be exported of a command, what was, and the folder that holds it whole or not at all."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from coupling.errors import ProgramError, one_of
from coupling.files.atomic_folder import FolderKind, whole_folder
from coupling.files.written_files import claim, is_of_kind
from coupling.programs.languages import Language, Targets
from coupling.programs.program import ProgramFile, RobotProgram
from coupling.results.export_result import ExportedProgramResult, ExportResult

# Largest loss by the export at the tool of the moving robot [m].
TOLERANCE = 5e-6
# Times this close are one [s].
_ONE_TIME = 1e-6
SUMMARY = "export.json"
# Kind of the folder.
_FOLDER_KIND = "export"


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


def is_export(folder: Path) -> bool:
    """Return whether a folder holds exported programs."""
    return is_of_kind(folder, _FOLDER_KIND) or (folder / SUMMARY).is_file()


EXPORT_FOLDER = FolderKind(_FOLDER_KIND, "an export", ProgramError, is_export)


def write_export(
    folder: Path, exports: Sequence[ExportedProgram], options: ExportOptions, overwrite: bool
) -> None:
    """Write programs and their summary, in the place of those that are there."""
    contents = dict(_contents(exports, options))
    with whole_folder(folder, EXPORT_FOLDER, overwrite) as draft:
        claim(draft, contents)
        for name, text in contents.items():
            (draft / name).write_bytes(text.encode())


def _contents(
    exports: Sequence[ExportedProgram], options: ExportOptions
) -> Iterator[tuple[str, str]]:
    for program in exports:
        for file in program.files:
            yield file.name, file.text
    result = ExportResult(
        language=options.language.name,
        targets=options.targets,
        tolerance_m=options.tolerance,
        robots=tuple(program.figures for program in exports),
    )
    yield SUMMARY, result.text()
