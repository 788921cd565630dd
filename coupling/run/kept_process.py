"""The process of a case, its answers checked and kept in a store of evaluations."""

from __future__ import annotations

from pathlib import Path

from coupling.case.case import Case
from coupling.events import Watch, unwatched
from coupling.process import Process, ProcessTable
from coupling.process.checked import CheckedProcess
from coupling.process.retried import RetriedProcess
from coupling.store import Store, StoredProcess


def checked_process(case: Case, watch: Watch = unwatched) -> Process:
    """Return the process of a case, its answers checked, tried as often as its table says.

    Args:
        watch: Function called with tries that fail.
    """
    table = case.process_table
    retries = table.retries if isinstance(table, ProcessTable) else 0
    return RetriedProcess(CheckedProcess(case.process, _name(case)), 1 + retries, watch)


def kept_process(case: Case, store: Path | None, watch: Watch = unwatched) -> StoredProcess:
    """Return the process of a case.

    Args:
        store: Folder of the store; None keeps nothing.
        watch: Function called with what happens.
    """
    place = None if store is None else Store(store, watch)
    return StoredProcess(
        checked_process(case, watch),
        place,
        watch,
        _name(case),
        lambda: case.process_table.identity(case.task),
    )


def _name(case: Case) -> str:
    return str(case.resolved["process"]["model"])
