"""Arguments and options that several commands have."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from coupling.errors import StoreError

# Name of the store beside the run folders.
STORE = "store"

CaseFile = Annotated[
    Path, typer.Argument(help="The case file, for example examples/cases/cone.toml.")
]
Output = Annotated[
    Path | None, typer.Option("-o", "--output", help="Run folder; results/<case> unless given.")
]
Overwrite = Annotated[bool, typer.Option("--overwrite", help="Replace a result that is there.")]
StoreFolder = Annotated[
    Path | None,
    typer.Option("--store", help="Store of evaluations; 'store' beside the run folder."),
]
NoStore = Annotated[
    bool, typer.Option("--no-store", help="Evaluate the process every time and keep nothing.")
]


def store_folder(run_folder: Path, store: Path | None, no_store: bool) -> Path | None:
    """Return the folder of the store of a run, None where it is to have none.

    Raises:
        StoreError: If the options contradict each other, or the store would be lost with the run.
    """
    from coupling.run.run_log import is_run

    if no_store:
        if store is not None:
            raise StoreError("expected either --store or --no-store, got both")
        return None
    found = store or run_folder.parent / STORE
    if found.resolve().is_relative_to(run_folder.resolve()):
        raise StoreError(
            f"{found}: the store lies in the run folder, which --overwrite replaces: name another"
            " place with --store"
        )
    if is_run(found):
        raise StoreError(f"{found}: expected a store of evaluations, got a run folder")
    return found
