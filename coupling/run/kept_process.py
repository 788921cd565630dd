"""The process of a case, its answers checked and kept in a store of evaluations."""

from __future__ import annotations

from pathlib import Path

from coupling.case import Case
from coupling.events import Watch, unwatched
from coupling.process.checked import CheckedProcess
from coupling.store import Store, StoredProcess


def kept_process(case: Case, store: Path | None, watch: Watch = unwatched) -> StoredProcess:
    """Return the process of a case.

    Args:
        case: The case.
        store: Folder of the store; None keeps nothing.
        watch: Function that is told what happens.
    """
    name = str(case.resolved["process"]["model"])
    place = None if store is None else Store(store, watch)
    checked = CheckedProcess(case.process, name)
    return StoredProcess(
        checked, place, watch, name, lambda: case.process_table.identity(case.task)
    )
