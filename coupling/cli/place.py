"""The command line: elastic-robot place."""

from __future__ import annotations

from contextlib import suppress
from pathlib import Path
from typing import Annotated, get_args

import typer
from rich.console import Console

from coupling.case import Case, load_case
from coupling.case_place import Objective
from coupling.cli.arguments import CaseFile, NoStore, Overwrite, StoreFolder, store_folder
from coupling.errors import CaseError, one_of
from coupling.events import Event, Progress
from coupling.files.scratch import remove_abandoned
from coupling.place.console import print_placement
from coupling.place.folder import read_placement, write_placement
from coupling.place.place import place as placed
from coupling.place.placing import placing, require_one_robot
from coupling.process import Process
from coupling.report.place_page import write_place_report
from coupling.run.console import RunView
from coupling.run.kept_process import kept_process
from coupling.run.new_folder import clear_for_work, new_run_folder
from coupling.run.run_log import RunLog


def place(
    case: CaseFile,
    output: Annotated[
        Path | None,
        typer.Option("-o", "--output", help="Folder; results/<case>_placed unless given."),
    ] = None,
    optimise: Annotated[
        str | None, typer.Option(help="stiffness, flanks or both; as in the case.")
    ] = None,
    overwrite: Overwrite = False,
    store: StoreFolder = None,
    no_store: NoStore = False,
) -> None:
    """Find where to put the part and how to hold the tool: stiff, and gears that keep their flank."""
    folder = output or Path("results", f"{case.stem}_placed")
    objective = _objective(optimise)
    kept = store_folder(folder, store, no_store)
    remove_abandoned()
    with RunView(Console()) as view, new_run_folder(folder, overwrite) as work:
        where = None if kept is None else str(kept.resolve())
        log = RunLog(work, "place", case, where)

        def watch(event: Event) -> None:
            log.watch(event)
            view.watch(event)

        def process_of(one: Case) -> Process:
            return kept_process(one, kept, watch)

        try:
            loaded = load_case(case, work, watch)
            require_one_robot(loaded)
            found = placed(placing(loaded, process_of(loaded), objective), process_of, watch)
            watch(Progress("writing the folder", 0, 1))
            write_placement(work, found)
            write_place_report(work)
            watch(Progress("writing the folder", 1, 1))
            log.finish(found.durations)
        except (Exception, KeyboardInterrupt) as error:
            with suppress(OSError):
                clear_for_work(work)  # half of a result is none
            log.stop(error)
            raise
    print_placement(Console(), read_placement(folder), folder)


def _objective(word: str | None) -> Objective | None:
    for known in get_args(Objective):
        if word == known:
            return known
    if word is None:
        return None
    raise CaseError(f"--optimise: {one_of(get_args(Objective), word)}")
