"""The run folder while a run goes on: who may write it, and when it takes the place of a result.

A new run works in its own folder, where `run.json` tells how far it is.  One that is to replace a
result works beside it, in `<name>.unfinished`, and changes places with it at its end, so that there is
a whole result at every moment.
"""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager, suppress
from pathlib import Path

from coupling.errors import ResultError
from coupling.files.atomic_file import writing
from coupling.files.atomic_folder import exclusively, finish_replacement, replace_folder
from coupling.files.written_files import WHOLE, begin_folder, claim, is_free, remove_written
from coupling.process.base import EVALUATIONS
from coupling.process.evaluation_folder import take_unfinished
from coupling.run.repeated_evaluation import AGAIN
from coupling.run.run_log import KIND, is_finished, is_run, read_log
from coupling.run.stored_run import RUN

# What a run writes from its start, and the next attempt at it needs.
_WHILE_IT_RUNS = (RUN, f"{EVALUATIONS}{WHOLE}", f"{AGAIN}{WHOLE}")


@contextmanager
def new_run_folder(folder: Path, overwrite: bool) -> Iterator[Path]:
    """Give the folder to work in, which is `folder` or becomes it where the block ends well.

    What a run that was killed has left is taken over.  A block that fails leaves the folder only where
    something was computed, and a note on the error tells where.

    Raises:
        ResultError: If another run is at it, `folder` exists and may not be replaced, or it cannot be
            written.
    """
    target = folder.resolve()
    unfinished = target.with_name(f"{target.name}.unfinished")
    with exclusively(folder, ResultError, lambda: _who(target, unfinished)):
        with writing(folder, ResultError):
            finish_replacement(target)
            if is_run(unfinished) and is_free(target):  # its result has been removed meanwhile
                replace_folder(unfinished, target)
            require_free(folder, overwrite)
            work = unfinished if is_finished(target) else target
            _require_own_files(work)
            clear_for_work(work)
            if work is unfinished:
                take_unfinished(target / EVALUATIONS, work / EVALUATIONS)
        try:
            with writing(folder, ResultError):
                yield work
        except BaseException as error:  # an interrupt as well: what was computed is worth finding
            _leave(work, error)
            raise
        if work is not target:
            with writing(folder, ResultError):
                replace_folder(work, target)


def require_free(folder: Path, overwrite: bool) -> None:
    """Refuse a folder that a run may not write.

    Raises:
        ResultError: If it holds a result and may not be replaced, or something else.
    """
    if not folder.exists():
        return
    if not folder.is_dir():
        raise ResultError(f"{folder}: expected the name of a folder, got a file")
    _require_own_files(folder)
    if is_finished(folder) and not overwrite:
        raise ResultError(f"{folder}: holds a result already: add --overwrite to replace it")


def _require_own_files(folder: Path) -> None:
    if not is_free(folder) and not is_run(folder):
        raise ResultError(f"{folder}: holds files that are not a result: name another folder")


def clear_for_work(work: Path) -> None:
    """Make the folder of a run, and remove from it the files of a result, which may be half of one.

    Raises:
        OSError: If something cannot be removed.
    """
    begin_folder(work, KIND)
    claim(work, _WHILE_IT_RUNS)
    remove_written(work, keep=_WHILE_IT_RUNS)


def _leave(work: Path, error: BaseException) -> None:
    """Remove the folder of a run that has computed nothing; say what there is in another one."""
    if (work / EVALUATIONS).exists():
        error.add_note(f"what the process computed is kept in {work / EVALUATIONS}")
    elif (log := read_log(work)) is None or not log.answers:
        with suppress(OSError):
            remove_written(work)


def _who(*places: Path) -> str:
    """Return which run is at a folder, in words."""
    logs = [log for log in map(read_log, places) if log is not None and log.state == "running"]
    if not logs:
        return "another run writes it"
    return f"process {logs[0].pid} on {logs[0].host} writes it since {logs[0].started}"
