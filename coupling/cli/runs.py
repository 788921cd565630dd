"""elastic-robot couple | compensate | report: from a case to its run folder."""

from __future__ import annotations

from collections.abc import Callable
from contextlib import suppress
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Annotated

import typer
from rich.console import Console

from coupling.case import Case, load_case
from coupling.cli.arguments import (
    CaseFile,
    NoStore,
    Output,
    Overwrite,
    StoreFolder,
    store_folder,
)
from coupling.events import Event, Progress, Watch
from coupling.files.scratch import remove_abandoned
from coupling.place.folder import FIGURES as PLACED
from coupling.report import write_report
from coupling.report.place_page import write_place_report
from coupling.report.study_page import write_study_report
from coupling.run.console import RunView, print_summary
from coupling.run.folder import write_run
from coupling.run.kept_process import kept_process
from coupling.run.new_folder import clear_for_work, new_run_folder
from coupling.run.run_log import RunLog
from coupling.run.study import Run, run_compensation, run_coupling
from coupling.study.folder import FIGURES

NOT_CONVERGED = 1


def couple(
    case: CaseFile,
    output: Output = None,
    overwrite: Overwrite = False,
    store: StoreFolder = None,
    no_store: NoStore = False,
) -> None:
    """Iterate robot and process until the path they agree on no longer changes."""
    folder = output or Path("results", case.stem)
    _run(case, folder, overwrite, store_folder(folder, store, no_store), "couple", run_coupling)


def compensate(
    case: CaseFile,
    output: Output = None,
    overwrite: Overwrite = False,
    store: StoreFolder = None,
    no_store: NoStore = False,
) -> None:
    """Correct the command until the tool follows the desired path."""
    folder = output or Path("results", case.stem)
    _run(
        case,
        folder,
        overwrite,
        store_folder(folder, store, no_store),
        "compensate",
        run_compensation,
    )


def report(
    folder: Annotated[
        Path, typer.Argument(help="A run folder, or that of a study or a placement.")
    ],
    output: Annotated[Path | None, typer.Option("-o", "--output", help="The HTML file.")] = None,
) -> None:
    """Write the report of a run folder, a study or a placement anew."""
    write = write_report
    for figures, of_another in ((FIGURES, write_study_report), (PLACED, write_place_report)):
        if (folder / figures).exists():
            write = of_another
    Console().print(f"report: {write(folder, output)}", soft_wrap=True)


@dataclass(frozen=True)
class Done:
    """A run that has come to its end.

    Attributes:
        case: Its case.
        run: Its result.
        from_store: Number of the process's answers that were taken from the store.
        unkept: Number of answers that could not be kept there.
    """

    case: Case
    run: Run
    from_store: int
    unkept: int


def _run(
    file: Path,
    folder: Path,
    overwrite: bool,
    store: Path | None,
    kind: str,
    work: Callable[[Case, Watch], Run],
) -> None:
    with RunView(Console()) as view:
        done = conduct(file, folder, overwrite, store, kind, work, view.watch)
    print_summary(Console(), done.case, done.run, folder, done.from_store)
    if done.unkept:
        text = f"Warning: {done.unkept} answers of the process could not be kept in {store}"
        Console().print(text, style="yellow", soft_wrap=True)
    if not done.run.correction.converged:
        raise typer.Exit(NOT_CONVERGED)


def conduct(
    file: Path,
    folder: Path,
    overwrite: bool,
    store: Path | None,
    kind: str,
    work: Callable[[Case, Watch], Run],
    tell: Watch,
) -> Done:
    """Run a case into its run folder.

    Args:
        file: The case file.
        folder: The run folder.
        overwrite: A result that is there may be replaced.
        store: Store of evaluations, if any.
        kind: "couple" or "compensate".
        work: What is to be done.
        tell: Function that is told what happens.

    Raises:
        CouplingError: If the case, the run, the folder or the store fails.
    """
    remove_abandoned()
    with new_run_folder(folder, overwrite) as place:
        kept = None if store is None else str(store.resolve())
        log = RunLog(place, kind, file, kept)

        def watch(event: Event) -> None:
            log.watch(event)
            tell(event)

        try:
            case = load_case(file, place, watch)
            process = kept_process(case, store, watch)
            run = work(replace(case, process=process), watch)
            process.settle()
            watch(Progress("writing the run folder", 0, 2))
            write_run(place, case, replace(run, keys=log.keys))
            watch(Progress("writing the report", 1, 2))
            write_report(place)
            log.finish(run.durations)
        except (Exception, KeyboardInterrupt) as error:
            with suppress(OSError):
                clear_for_work(place)  # half of a result is none
            log.stop(error)
            _note(error, log, store)
            raise
    return Done(case, run, log.answers_from("store"), process.unkept)


def _note(error: BaseException, log: RunLog, store: Path | None) -> None:
    """Say where the answers so far are, on an error that ends the run."""
    if store is not None and any(log.keys):
        error.add_note(
            f"answers of the process so far, kept in {store}: {len(log.keys)}; the same command goes"
            " on from there"
        )
