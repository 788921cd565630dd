"""What the commands that fit a robot write: its file, and beside it figures and the report."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

import typer

from coupling.cli.console import console
from coupling.errors import CouplingError
from coupling.files.atomic_file import make_folder_of, write_atomically
from coupling.files.output_file import require_output
from coupling.report.terminal import print_sections
from coupling.results.cutting_result import CuttingIdentified
from coupling.results.identified_result import IdentifiedResult
from coupling.results.motion_result import MotionResult
from coupling.results.response_result import ResponseFitResult
from coupling.results.section import Section

_REFUSED = 1


def robot_target(output: Path | None, name: str, error: type[CouplingError]) -> Path:
    """Return the robot file to write: `output`, else the name in the folder results."""
    target = output or Path("results", f"{name}.toml")
    for ending in (".toml", ".html"):
        require_output(
            target.with_suffix(ending) if target.suffix == ".toml" else target, ending, error
        )
    figures = target.with_suffix(".json")
    if figures.exists() and not target.with_suffix(".html").exists():
        raise error(
            f"{figures}: holds what no elastic-robot command has written there, as there is no report"
            " beside it: give another name (--output), or remove it"
        )
    return target


def write_findings(
    target: Path,
    result: IdentifiedResult | MotionResult | ResponseFitResult | CuttingIdentified,
    summary: Sequence[Section],
    page: str,
    error: type[CouplingError],
) -> None:
    """Print a summary, write figures and page beside the robot file; exit if that is refused."""
    make_folder_of(target, error)
    print_sections(console, summary)
    report = target.with_suffix(".html")
    write_atomically(report, page, error)  # says whose the figures are
    write_atomically(target.with_suffix(".json"), result.text() + "\n", error)
    console.print(f"Report: {report}")
    if result.refusal:
        raise typer.Exit(_REFUSED)


def write_robot(target: Path, text: str, error: type[CouplingError]) -> None:
    """Write the robot file and say where it is."""
    write_atomically(target, text, error)
    console.print(f"Robot file: {target}")
