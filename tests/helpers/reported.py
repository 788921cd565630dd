"""A case compensated, with its run folder and report."""

from pathlib import Path

from coupling.case.case import Case
from coupling.cli.console import console
from coupling.report.run_report import run_report
from coupling.report.stored_result import write_report
from coupling.report.terminal import print_sections
from coupling.run.execute import Run, run_compensation
from coupling.run.folder import write_run
from coupling.run.stored_run import read_run


def compensated(folder: Path, case: Case) -> tuple[Case, Run, Path]:
    """Return the case, its run, and the run folder, `out` in a folder."""
    run = run_compensation(case)
    out = folder / "out"
    out.mkdir()
    write_run(out, case, run)
    write_report(out)
    return case, run, out


def on_terminal(folder: Path) -> str:
    """Return what the terminal shows of a run folder."""
    with console.capture() as said:
        print_sections(console, run_report(read_run(folder)).content)
    return said.get()
