"""The run folder while a run goes on: who may write it, and when it takes the place of a result.

A new run works in its own folder, where `run.json` tells how far it is.  One that is to replace a
result works beside it, in `<name>.unfinished`, and changes places with it at its end, so that there is
a whole result at every moment.
"""

from __future__ import annotations

import os
import shutil
import tempfile
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from pathlib import Path

from filelock import FileLock, Timeout

from coupling.errors import ResultError
from coupling.files.whole_file import sync_folder
from coupling.process.base import EVALUATIONS
from coupling.run.run_log import is_finished, is_run, read_log
from coupling.run.stored_run import RUN


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
    lock = FileLock(target.with_name(f"{target.name}.lock"))
    beside, replaced = (
        target.with_name(f"{target.name}.{end}") for end in ("unfinished", "replaced")
    )
    with _errors(folder):
        target.parent.mkdir(parents=True, exist_ok=True)
        tempfile.TemporaryFile(dir=target.parent).close()  # it can be written
        try:
            lock.acquire(timeout=0)
        except Timeout:
            raise ResultError(f"{folder}: {_who(target, beside)}") from None
    try:
        with _errors(folder):
            _put_back(target, replaced)
            _require_free(folder, overwrite)
            work = beside if is_finished(target) else target
            if work is target and beside.exists() and not _is_filled(target):
                _take_away(target)
                os.rename(beside, target)  # its result has been removed meanwhile
            clear_for_work(work)
        try:
            with _errors(folder):
                yield work
        except BaseException as error:  # an interrupt as well: what was computed is worth finding
            _leave(work, error)
            raise
        with _errors(folder):
            if work is not target:
                os.rename(target, replaced)
                os.rename(work, target)
                sync_folder(target.parent)
                shutil.rmtree(replaced)
    finally:
        with suppress(OSError):
            os.unlink(lock.lock_file)
        lock.release()


def _put_back(target: Path, replaced: Path) -> None:
    """Clean up after a run that was killed while it changed places with a result."""
    if not replaced.exists():
        return
    if target.exists():
        shutil.rmtree(replaced)
    else:
        os.rename(replaced, target)


def _require_free(folder: Path, overwrite: bool) -> None:
    if not folder.exists():
        return
    if not folder.is_dir():
        raise ResultError(f"{folder}: expected the name of a folder, got a file")
    if not _is_filled(folder):
        return
    if not is_run(folder):
        raise ResultError(f"{folder}: holds files that are not a result: name another folder")
    if is_finished(folder) and not overwrite:
        raise ResultError(f"{folder}: holds a result already: add --overwrite to replace it")


def _is_filled(folder: Path) -> bool:
    return folder.exists() and any(folder.iterdir())


def _take_away(folder: Path) -> None:
    if folder.exists():
        folder.rmdir()


def clear_for_work(work: Path) -> None:
    """Make the folder of a run, and remove from it all but run.json and the evaluations.

    Raises:
        OSError: If something cannot be removed.
    """
    work.mkdir(exist_ok=True)
    for left in work.iterdir():
        if left.name in (EVALUATIONS, RUN):
            continue
        if left.is_dir() and not left.is_symlink():
            shutil.rmtree(left)
        else:
            left.unlink()


def _leave(work: Path, error: BaseException) -> None:
    """Remove the folder of a run that has computed nothing; say what there is in another one."""
    if (work / EVALUATIONS).exists():
        error.add_note(f"what the process computed is kept in {work / EVALUATIONS}")
    elif not read_log(work).get("answers"):
        shutil.rmtree(work, ignore_errors=True)


def _who(*places: Path) -> str:
    """Return which run is at a folder, in words."""
    logs = [log for log in map(read_log, places) if log.get("state") == "running"]
    if not logs:
        return "another run writes it: wait for its end, or name another folder"
    log = logs[0]
    return (
        f"process {log.get('pid')} on {log.get('host')} writes it since {log.get('started')}: wait for"
        " its end, or name another folder"
    )


@contextmanager
def _errors(folder: Path) -> Iterator[None]:
    try:
        yield
    except OSError as cause:
        raise ResultError(f"{folder}: cannot be written: {cause.strerror or cause}") from cause
