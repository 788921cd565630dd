"""From a case file to its run folder, with its report."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from pathlib import Path

from coupling.case.case import Case
from coupling.case.file import load_case
from coupling.events import Progress, Watch
from coupling.report.report_file import name_path
from coupling.report.run_report import run_report
from coupling.report.stored_result import write_figures
from coupling.results.stability_result import FIGURES as STABILITY
from coupling.run.execute import Run
from coupling.run.folder import write_run
from coupling.run.stored_run import StoredRun, read_run
from coupling.run.unfinished_folder import logged_folder
from coupling.stability.clear_chatter import ClearChatterError, refuse_clear_chatter


@dataclass(frozen=True)
class FinishedRun:
    """A run that has come to its end.

    Attributes:
        run: Its result.
        stored: Content of its folder.
    """

    run: Run
    stored: StoredRun

    @property
    def is_good(self) -> bool:
        """Whether the command was found, and no cut of it chatters."""
        figures = self.stored.figures
        return figures.converged and figures.is_stable


def run_to_folder(
    file: Path,
    folder: Path,
    overwrite: bool,
    store: Path | None,
    kind: str,
    work: Callable[[Case, Watch, Path | None], Run],
    report: Watch,
    words: Sequence[str] | None = None,
) -> FinishedRun:
    """Run a case into its run folder.

    Args:
        file: The case file.
        overwrite: A result that is there may be replaced.
        store: Store of evaluations, if any.
        kind: "couple" or "compensate".
        work: Function that does it with a case, its watch and the store.
        report: Function called with what happens.
        words: Words of the command, which ends where a cut chatters clearly; None: any cut is computed.

    Raises:
        ClearChatterError: If the cut does; the folder holds its stability then.
        CouplingError: If the case, the run, the folder or the store fails.
    """
    refusal: ClearChatterError | None = None
    with logged_folder(kind, file, folder, overwrite, store, report) as (place, log, watch):
        case = load_case(file, place, watch)
        try:
            if words is not None:
                refuse_clear_chatter(case, name_path(file), words, watch)
        except ClearChatterError as error:
            refusal = error
            write_figures(place / STABILITY, refusal.stability)
            log.finish({})
        else:
            run = work(case, watch, store)
            watch(Progress("writing the run folder", 0, 2))
            tables = write_run(place, case, replace(run, keys=log.keys))
            watch(Progress("writing the report", 1, 2))
            stored = read_run(place, tables)
            run_report(stored).write(place)
            log.finish(run.durations)
    if refusal is not None:
        raise refusal  # behind the folder, which holds why
    return FinishedRun(run, stored)


def limits_to_folder(
    file: Path, folder: Path, overwrite: bool, kind: str, words: Sequence[str], report: Watch
) -> None:
    """End a command whose cut chatters clearly, before it computes what its run only needs later.

    Args:
        file, folder, overwrite, kind, report: As of `run_to_folder`.
        words: Words of the command.

    Raises:
        ClearChatterError: If the cut does; the folder holds its stability then.
        CouplingError: If the case or the folder fails.
    """
    try:
        refuse_clear_chatter(load_case(file), name_path(file), words, report)
    except ClearChatterError as refusal:
        with logged_folder(kind, file, folder, overwrite, None, report) as (place, log, _):
            write_figures(place / STABILITY, refusal.stability)
            log.finish({})
        raise
