"""Folders that one command at a time writes, and that change places with what they replace.

A folder is replaced by two renames: the old one is put aside as `.<name>.replaced`, and the new one gets
its name.  Where a command was killed between them, the next one puts the old one back.  What is not the
command's in the old one comes into the new one.
"""

from __future__ import annotations

import os
import tempfile
from collections.abc import Callable, Iterator
from contextlib import contextmanager, suppress
from pathlib import Path

from filelock import FileLock, Timeout

from coupling.files.atomic_file import sync_folder, writing
from coupling.files.written_files import hand_over


@contextmanager
def exclusively(
    folder: Path,
    error: type[Exception],
    who: Callable[[], str] = lambda: "another command writes it",
) -> Iterator[None]:
    """Keep other commands from writing a folder; what was killed keeps nobody away.

    Args:
        folder: The folder, which need not be there; the one that it is in is made.
        error: Raised where another command writes it, or no file can be made in it or beside it.
        who: Function that says which one does, in words.

    Example:
        >>> import tempfile
        >>> folder = Path(tempfile.mkdtemp(), "made")
        >>> with exclusively(folder, ValueError):
        ...     try:
        ...         exclusively(folder, ValueError).__enter__()
        ...     except ValueError as error:
        ...         print(str(error).partition(": ")[2])
        another command writes it: wait for its end, or name another folder
    """
    target = folder.resolve()
    # It could be renamed nevertheless, after all the work, and its files could not be moved.
    if target.is_dir() and not os.access(target, os.W_OK | os.X_OK):
        raise error(
            f"{folder}: expected a folder that this user may write into, got one of another user or one"
            " that is read-only: name another folder"
        )
    lock = FileLock(target.with_name(f".{target.name}.lock"))
    with writing(folder, error):
        target.parent.mkdir(parents=True, exist_ok=True)
        tempfile.TemporaryFile(dir=target.parent).close()  # else filelock may say it were locked
        try:
            lock.acquire(timeout=0)
        except Timeout:
            advice = "wait for its end, or name another folder"
            raise error(f"{folder}: {who()}: {advice}") from None
    try:
        yield
    finally:
        with suppress(OSError):
            os.unlink(lock.lock_file)
        lock.release()


def replaced_name(target: Path) -> Path:
    """Return where a folder is while another one takes its place."""
    return target.with_name(f".{target.name}.replaced")


def finish_replacement(target: Path) -> None:
    """Clean up after a command that was killed while a folder was replaced."""
    old = replaced_name(target)
    if not old.exists():
        return
    if target.exists():
        hand_over(old, target)
    else:
        os.rename(old, target)


def replace_folder(draft: Path, target: Path) -> None:
    """Put a folder in the place of another one, or where none is.

    Raises:
        OSError: If it cannot be renamed; the other one is then in its place.
    """
    old = replaced_name(target)
    if target.exists():
        os.rename(target, old)
    try:
        os.rename(draft, target)
    except OSError:
        if old.exists():
            os.rename(old, target)
        raise
    sync_folder(target.parent)
    if old.exists():
        hand_over(old, target)
