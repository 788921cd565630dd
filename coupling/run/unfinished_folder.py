"""The run folder while a run goes on: who writes it, how far it is, and what remains of one that fails.

A run works in `<name>.unfinished`, where `run.json` tells how far it is, so that under its name a result
is complete at every moment.
"""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager, suppress
from pathlib import Path

from coupling.errors import ResultError
from coupling.events import Event, Watch
from coupling.files.atomic_folder import FolderKind, unfinished_name, whole_folder
from coupling.files.scratch import remove_abandoned
from coupling.files.written_files import WHOLE, remove_written
from coupling.process.base import EVALUATIONS
from coupling.process.evaluation_folder import move_unfinished
from coupling.run.repeated_evaluation import AGAIN
from coupling.run.run_log import KIND, RunLog, is_finished, is_run, is_to_go_on, read_log
from coupling.run.stored_run import RUN

RUN_FOLDER = FolderKind(KIND, "a result", ResultError, is_run, is_finished)
# What a run writes from its start, and the next attempt at it needs.
_WHILE_IT_RUNS = (RUN, f"{EVALUATIONS}{WHOLE}", f"{AGAIN}{WHOLE}")


@contextmanager
def logged_folder(
    kind: str,
    case: Path,
    folder: Path,
    overwrite: bool,
    store: Path | None,
    report: Watch,
    keep: tuple[str, ...] = (),
) -> Iterator[tuple[Path, RunLog, Watch]]:
    """Give the folder to work in, its log, and what notes an event there and tells it.

    What a run that was killed has left is taken over.  A block that fails leaves the folder only where
    something was computed, and a note on the error tells where.

    Args:
        keep: Names of further files that the next attempt needs.

    Raises:
        CouplingError: If another run writes the folder, or it may not or cannot be written.
    """
    remove_abandoned()
    target = folder.resolve()
    may_replace = overwrite or is_to_go_on(folder, kind, case)
    with whole_folder(
        folder,
        RUN_FOLDER,
        may_replace,
        (*_WHILE_IT_RUNS, *keep),
        lambda: _who(unfinished_name(target)),
    ) as work:
        move_unfinished(target / EVALUATIONS, work / EVALUATIONS)
        log = RunLog(work, kind, case, None if store is None else str(store.resolve()))

        def watch(event: Event) -> None:
            log.watch(event)
            report(event)

        try:
            yield work, log, watch
        except BaseException as error:  # an interrupt as well: what was computed is worth finding
            log.stop(error)
            if store is not None and any(log.keys):
                error.add_note(
                    f"evaluations so far, kept in {store}: {len(log.keys)}; the same"
                    f" command {'takes them' if keep else 'continues'} from there"
                )
            if (work / EVALUATIONS).exists():
                error.add_note(f"what the process computed is kept in {work / EVALUATIONS}")
            elif not log.keys and not any((work / name).exists() for name in keep):
                with suppress(OSError):
                    remove_written(work)
            raise


def _who(work: Path) -> str:
    """Return which run works in a folder, in words."""
    log = read_log(work)
    if log is None or log.state != "running":
        return "another run writes it"
    return f"process {log.pid} on {log.host} writes it since {log.started}"
