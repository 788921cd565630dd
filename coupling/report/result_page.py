"""The page of any result, written by what its folder holds."""

from __future__ import annotations

from pathlib import Path

from coupling.errors import ResultError
from coupling.files.written_files import REPORT, claim_file
from coupling.place.folder import StoredPlacement
from coupling.report.modes_report import modes_page
from coupling.report.place_report import place_page
from coupling.report.report_file import name_path, write_page
from coupling.report.run_report import write_pages
from coupling.report.stability_report import stability_page
from coupling.report.stored_result import read_result
from coupling.report.study_report import study_page
from coupling.results.base import ResultFile
from coupling.results.modes_result import ModesResult
from coupling.results.stability_result import StabilityResult
from coupling.run.stored_run import StoredRun
from coupling.study.stored_study import StoredStudy


def write_figures(file: Path, result: ResultFile) -> None:
    """Write the figures of a result into the folder of its command, and their page beside them.

    Raises:
        CouplingError: If the page cannot be written.
        OSError: If the figures cannot.
    """
    claim_file(file).write_text(result.text(), encoding="utf-8")
    write_report(file.parent)


def write_report(folder: Path, file: Path | None = None) -> Path:
    """Write the report of a result; in the folder of a cell's run, also those of its robots.

    Args:
        folder: Folder of a run, a study, a placement, of stability or modes.
        file: File to write; report.html in the folder unless given.

    Returns:
        The file.

    Raises:
        CouplingError: If the result cannot be read or the report not written.
    """
    target = file or folder / REPORT
    match read_result(folder):
        case StoredRun() as run:
            write_pages(run, target)
            return target
        case StoredStudy() as study:
            page = study_page(study, folder)
        case StoredPlacement() as placement:
            page = place_page(placement, name_path(folder))
        case StabilityResult() as stability:
            page = stability_page(stability)
        case ModesResult() as modes:
            page = modes_page(modes)
    write_page(target, page, ResultError)
    return target
