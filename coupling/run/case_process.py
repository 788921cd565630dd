"""The process of a case as commands evaluate it."""

from __future__ import annotations

from pathlib import Path

from coupling.case.case import Case
from coupling.events import Watch, unwatched
from coupling.process import ProcessTable
from coupling.process.smoothing import NoiseRemoval
from coupling.store import EvaluatedProcess, Store


def evaluated_process(
    case: Case,
    store: Path | None = None,
    watch: Watch = unwatched,
    noise_removal: NoiseRemoval | None = None,
) -> EvaluatedProcess:
    """Return the process of a case, its answers checked, tried as often as its table says."""
    table = case.process_table
    return EvaluatedProcess(
        case.process,
        None if store is None else Store(store, watch),
        watch,
        name=str(case.resolved["process"]["model"]),
        tries=1 + (table.retries if isinstance(table, ProcessTable) else 0),
        identify=lambda: table.identity(case.task),
        noise_removal=noise_removal,
    )
