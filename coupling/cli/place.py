"""The command line: elastic-robot place."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Annotated, get_args

import typer

from coupling.cli.arguments import (
    CaseFile,
    NoStore,
    Overwrite,
    StoreFolder,
    Verbose,
    store_folder,
)
from coupling.cli.console import console
from coupling.cli.runs import NOT_CONVERGED
from coupling.errors import CaseError, one_of
from coupling.events import Progress

if TYPE_CHECKING:
    from coupling.case.case import Case
    from coupling.case.place import Objective
    from coupling.process import Process


def place(
    case: CaseFile,
    output: Annotated[
        Path | None,
        typer.Option("-o", "--output", help="Folder; results/<case>_placed unless given."),
    ] = None,
    optimise: Annotated[
        str | None, typer.Option(help="stiffness, backlash, both or stability; as in the case.")
    ] = None,
    overwrite: Overwrite = False,
    store: StoreFolder = None,
    no_store: NoStore = False,
    verbose: Verbose = False,
) -> None:
    """Find the place of part and tool where the robot is stiff and its gears do not reverse."""
    from coupling.case.file import load_case
    from coupling.files.written_files import REPORT
    from coupling.place.folder import read_placement, write_placement
    from coupling.place.place import place as placed
    from coupling.place.placing import placing, require_one_robot
    from coupling.place.search_state import STATE, SearchState
    from coupling.report.place_report import place_report
    from coupling.report.terminal import print_report
    from coupling.run.console import RunView
    from coupling.run.unfinished_folder import logged_folder

    folder = output or Path("results", f"{case.stem}_placed")
    objective = _objective(optimise)
    evaluations = store_folder(folder, store, no_store)
    with (
        RunView(console, verbose) as view,
        logged_folder("place", case, folder, overwrite, evaluations, view.watch, keep=(STATE,)) as (
            work,
            log,
            watch,
        ),
    ):

        def process_of(case: Case) -> Process:
            return case.evaluated_process(evaluations, watch)

        loaded = load_case(case, work, watch)
        require_one_robot(loaded)
        to_place = placing(loaded, process_of(loaded), objective)
        state = SearchState(work, to_place)
        try:
            placement = placed(to_place, process_of, watch, state)
        except KeyboardInterrupt as stop:
            stop.add_note(state.in_words)
            raise
        state.forget()
        watch(Progress("writing the folder", 0, 1))
        write_placement(work, placement)
        stored = read_placement(work)
        report = place_report(stored)
        report.write(work)
        watch(Progress("writing the folder", 1, 1))
        log.finish(placement.durations)
    print_report(console, report, verbose)
    console.print(f"Placement: {folder}  (report: {folder / REPORT})")
    best = stored.figures.best[0].stability
    if best is not None and not best.stable:
        raise typer.Exit(NOT_CONVERGED)


def _objective(word: str | None) -> Objective | None:
    from coupling.case.place import Objective

    for objective in get_args(Objective):
        if word == objective:
            return objective
    if word is None:
        return None
    raise CaseError(f"--optimise: {one_of(get_args(Objective), word)}")
