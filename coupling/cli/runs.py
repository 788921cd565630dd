"""elastic-robot couple | compensate | report: from a case to its run folder."""

from __future__ import annotations

import shlex
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from coupling.cli.arguments import (
    CaseFile,
    DespiteChatter,
    NoStore,
    Output,
    Overwrite,
    StoreFolder,
    Verbose,
    store_folder,
)
from coupling.cli.console import console
from coupling.cli.stability import print_stability
from coupling.events import Progress

if TYPE_CHECKING:
    from coupling.results.run_result import Kind
    from coupling.run_to_folder import FinishedRun

NOT_CONVERGED, BAD_INPUT = 1, 2


def _run_command(kind: Kind, meaning: str) -> Callable[..., None]:
    """Return the command that runs a case by one of the methods, described by its meaning."""

    def command(
        case: CaseFile,
        output: Output = None,
        overwrite: Overwrite = False,
        store: StoreFolder = None,
        no_store: NoStore = False,
        despite_chatter: DespiteChatter = False,
        verbose: Verbose = False,
    ) -> None:
        from coupling.report.report_file import name_path
        from coupling.run.console import RunView
        from coupling.run.execute import run_compensation, run_coupling
        from coupling.run_to_folder import run_to_folder

        folder = output or Path("results", case.stem)
        evaluations = store_folder(folder, store, no_store)
        words = None if despite_chatter else (kind, name_path(case), "-o", str(folder))
        work = run_coupling if kind == "couple" else run_compensation
        with (
            pointing_to_check(case),
            ended_by_chatter(folder, verbose),
            RunView(console, verbose) as view,
        ):
            finished = run_to_folder(
                case, folder, overwrite, evaluations, kind, work, view.watch, words
            )
        print_run(finished, folder, verbose)
        if finished.run.not_stored:
            count = finished.run.not_stored
            text = f"Warning: {count} evaluations could not be kept in {evaluations}"
            console.print(text, style="yellow")
        if not finished.run.correction.converged:
            raise typer.Exit(NOT_CONVERGED)

    command.__name__, command.__doc__ = kind, meaning
    return command


couple = _run_command(
    "couple", "Evaluate robot and process in turn until path and forces no longer change."
)
compensate = _run_command(
    "compensate", "Correct the command until the tool follows the desired path."
)


def report(
    folder: Annotated[
        Path, typer.Argument(help="Folder of a result of any command, or of many of them.")
    ],
    output: Annotated[Path | None, typer.Option("-o", "--output", help="The HTML file.")] = None,
) -> None:
    """Write the report of a result's folder anew, or an index of many."""
    from coupling.report.index_report import write_index
    from coupling.report.stored_result import is_result, write_report
    from coupling.run.console import RunView

    write = write_report if is_result(folder) or not folder.is_dir() else write_index
    with RunView(console) as view:
        view.watch(Progress("drawing the page", 0, 1))
        page = write(folder, output)
    console.print(f"report: {page}")


@contextmanager
def pointing_to_check(file: Path) -> Iterator[None]:
    """Add to an error of a path that a robot cannot follow the command that shows where."""
    from coupling.errors import CouplingError, cause_of
    from coupling.robot.blocked_path import UnreachableError

    try:
        yield
    except CouplingError as error:
        if cause_of(error, UnreachableError) is None:
            raise
        command = shlex.join(["elastic-robot", "check", str(file)])
        error.add_note(f"to see where the robot stops, and what is in the way: {command}")
        raise


@contextmanager
def ended_by_chatter(folder: Path, verbose: bool) -> Iterator[None]:
    """End a command whose cut chatters with its limits, which are in a folder, on the screen."""
    from coupling.stability.clear_chatter import ClearChatterError

    try:
        yield
    except ClearChatterError as refusal:
        print_stability(refusal.stability, folder, verbose)
        raise typer.Exit(NOT_CONVERGED) from refusal


def print_run(finished: FinishedRun, folder: Path, verbose: bool = False) -> None:
    """Say what a run found and where it is."""
    from coupling.report.run_report import run_report
    from coupling.report.terminal import print_report

    print_report(console, run_report(finished.stored), verbose)
    seconds = sum(finished.run.durations.values())
    console.print(f"Result: {folder}  (report: {folder / 'report.html'}; {seconds:.1f} s)")
    for language in _earlier_exports(folder):
        text = (
            f"Warning: the programs in {folder / language} are of an earlier command: elastic-robot"
            f" export {shlex.quote(str(folder))} --to {language} --overwrite"
        )
        console.print(text, style="yellow")


def _earlier_exports(folder: Path) -> list[str]:
    """Return the languages whose programs stand in the folder of a run that has just ended."""
    if not any(entry.is_dir() for entry in folder.iterdir()):
        return []  # before the languages are imported, a third of a second
    from coupling.export.exported_program import is_export
    from coupling.programs.languages import LANGUAGES

    return [language for language in LANGUAGES if is_export(folder / language)]
