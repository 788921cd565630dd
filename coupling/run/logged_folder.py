"""A run folder while work goes on in it: a log of what happens, and no half result of what fails."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager, suppress
from pathlib import Path

from coupling.events import Event, Watch
from coupling.files.scratch import remove_abandoned
from coupling.run.new_folder import clear_for_work, new_run_folder
from coupling.run.run_log import RunLog, is_to_go_on


@contextmanager
def logged_folder(
    kind: str, case: Path, folder: Path, overwrite: bool, store: Path | None, report: Watch
) -> Iterator[tuple[Path, RunLog, Watch]]:
    """Give the folder to work in, its log, and what notes an event there and tells it.

    Args:
        kind: "couple", "compensate" or "place".
        case: The case file.
        folder: Folder of the result.
        overwrite: A result that is there may be replaced.
        store: Store of evaluations, if any.
        report: Function called with what happens.

    Raises:
        CouplingError: If the folder cannot be written.
    """
    remove_abandoned()
    with new_run_folder(folder, overwrite or is_to_go_on(folder, kind, case)) as place:
        store_path = None if store is None else str(store.resolve())
        log = RunLog(place, kind, case, store_path)

        def watch(event: Event) -> None:
            log.watch(event)
            report(event)

        try:
            yield place, log, watch
        except (Exception, KeyboardInterrupt) as error:
            with suppress(OSError):
                clear_for_work(place)  # half of a result is none
            log.stop(error)
            if store is not None and any(log.keys):
                error.add_note(
                    f"evaluations so far, kept in {store}: {len(log.keys)}; the same"
                    " command continues from there"
                )
            raise
