"""What identify writes: the file that is fitted, and beside it figures and the report."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

import typer

from coupling.cli.console import console
from coupling.errors import IdentifyError
from coupling.files.atomic_file import make_folder_of, write_atomically
from coupling.files.output_file import require_output
from coupling.report.result_report import ResultReport
from coupling.report.terminal import print_report
from coupling.results.parameter_result import FitResult

_REFUSED = 1


def fitted_target(output: Path | None, name: str) -> Path:
    """Return the file to write: `output`, else the name in the folder results.

    Raises:
        IdentifyError: If what is in its place, or beside it, was not written by elastic-robot.
    """
    target = output or Path("results", f"{name}.toml")
    for ending in (".toml", ".html"):
        require_output(
            target.with_suffix(ending) if target.suffix == ".toml" else target,
            ending,
            IdentifyError,
        )
    figures = target.with_suffix(".json")
    if figures.exists() and not target.with_suffix(".html").exists():
        raise IdentifyError(
            f"{figures}: holds what no elastic-robot command has written there, as there is no report"
            " beside it: give another name (--output), or remove it"
        )
    return target


def write_fitted(
    target: Path,
    report: ResultReport,
    result: FitResult,
    text: Callable[[], str],
    is_verbose: bool,
) -> None:
    """Print what was identified, write figures and page, and unless it is refused the file.

    Args:
        target: File that is fitted.
        report: First screen and sections on it.
        result: Its figures.
        text: Function that returns the content of the file.
        is_verbose: Whether all is printed that the page says.

    Raises:
        Exit: If it is refused, with status 1.
    """
    make_folder_of(target, IdentifyError)
    print_report(console, report, is_verbose)
    file = target.with_suffix(".html")
    write_atomically(file, report.page, IdentifyError)  # says whose the figures are
    write_atomically(target.with_suffix(".json"), result.text() + "\n", IdentifyError)
    console.print(f"Report: {file}")
    if result.refusal:
        if target.exists():
            console.print(f"{target}: from an earlier run, unchanged")
        raise typer.Exit(_REFUSED)
    write_atomically(target, text(), IdentifyError)
    console.print(f"File: {target}")
