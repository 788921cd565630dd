"""The kinds of results: the file that tells a folder apart, how it is read, and what is told of it."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from typing import Any, NamedTuple

from coupling.errors import ResultError
from coupling.files.atomic_folder import unfinished_name
from coupling.files.written_files import claim_file
from coupling.place.folder import FIGURES as PLACED
from coupling.place.folder import StoredPlacement, read_placement
from coupling.report.modes_report import modes_report
from coupling.report.place_report import place_report
from coupling.report.result_report import ResultReport
from coupling.report.run_report import run_report
from coupling.report.stability_report import stability_report
from coupling.report.study_report import study_report
from coupling.results.base import ResultFile
from coupling.results.modes_result import FIGURES as MODES
from coupling.results.modes_result import ModesResult
from coupling.results.stability_result import FIGURES as STABILITY
from coupling.results.stability_result import StabilityResult
from coupling.run.run_log import is_run
from coupling.run.stored_run import RESULT, StoredRun, read_run
from coupling.study.findings import StoredStudy, read_study
from coupling.study.folder import FIGURES as STUDIED

StoredResult = StoredRun | StoredStudy | StoredPlacement | StabilityResult | ModesResult


class ResultKind(NamedTuple):
    """A kind of results.

    Attributes:
        type: Class of what is read.
        read: Function that reads a folder.
        report: Function that returns what is told of it.
    """

    type: type[StoredResult]
    read: Callable[[Path], StoredResult]
    report: Callable[[Any], ResultReport]


# By the file that holds the figures.
KINDS = {
    STUDIED: ResultKind(StoredStudy, read_study, study_report),
    PLACED: ResultKind(StoredPlacement, read_placement, place_report),
    STABILITY: ResultKind(
        StabilityResult,
        lambda folder: StabilityResult.read(folder / STABILITY, ResultError),
        stability_report,
    ),
    MODES: ResultKind(
        ModesResult, lambda folder: ModesResult.read(folder / MODES, ResultError), modes_report
    ),
    RESULT: ResultKind(StoredRun, read_run, run_report),
}


def figures_file(folder: Path) -> Path | None:
    """Return the file with the figures of a folder's result; None where there is none."""
    return next((file for name in KINDS if (file := folder / name).is_file()), None)


def is_result(folder: Path) -> bool:
    """Return whether a folder is that of a result, finished or not."""
    return figures_file(folder) is not None or is_run(folder)


def read_result(folder: str | Path) -> StoredResult:
    """Return a result by its folder: a run, a study, a placement, stability or modes.

    Raises:
        CouplingError: If there is none, or it is damaged.
    """
    folder = Path(folder)
    file = figures_file(folder)
    if file is None and (is_run(folder) or is_run(unfinished_name(folder.resolve()))):
        return read_run(folder)  # says why there is no result yet
    if file is None:
        raise ResultError(
            f"{folder}: expected the folder of a run, a study, a placement, of stability or modes"
        )
    return KINDS[file.name].read(folder)


def report_of(result: StoredResult) -> ResultReport:
    """Return what is told of a result."""
    return next(kind.report(result) for kind in KINDS.values() if isinstance(result, kind.type))


def write_report(folder: Path, file: Path | None = None) -> Path:
    """Write the page of a result; of a cell's run, also those of its robots.

    Args:
        folder: Folder of a run, a study, a placement, of stability or modes.
        file: File to write; report.html in the folder unless given.

    Returns:
        The file.

    Raises:
        CouplingError: If the result cannot be read or the page not written.
    """
    return report_of(read_result(folder)).write(folder, file)


def write_figures(file: Path, result: ResultFile) -> None:
    """Write the figures of a result into the folder of its command, and their page beside them.

    Raises:
        CouplingError: If the page cannot be written.
        OSError: If the figures cannot.
    """
    claim_file(file).write_text(result.text(), encoding="utf-8")
    write_report(file.parent)
