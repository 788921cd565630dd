"""Folders that one command at a time writes, and that have their name when they are complete.

A folder is `<name>.unfinished` until it is complete and on the disk.  One of its name is replaced by two
renames: the old one is put aside as `.<name>.replaced`, and the new one gets its name.  Where a command
was killed between them, the next one puts the old one back.  What is not the command's in the old one
comes into the new one.
"""

from __future__ import annotations

import os
import tempfile
from collections.abc import Callable, Iterable, Iterator
from contextlib import contextmanager, suppress
from dataclasses import dataclass
from pathlib import Path

from filelock import FileLock, Timeout

from coupling.errors import ResultError
from coupling.files.atomic_file import require_writable_place, sync_file, sync_folder, writing
from coupling.files.written_files import (
    begin_folder,
    claim,
    hand_over,
    is_free,
    is_of_kind,
    listed_files,
    remove_written,
)


@dataclass(frozen=True)
class FolderKind:
    """Kind of folder that a command writes.

    Attributes:
        name: Its name in the list of what was written, such as "run".
        content: Its content in words, such as "a result".
    """

    name: str
    content: str
    error: type[Exception]
    is_of: Callable[[Path], bool]
    is_complete: Callable[[Path], bool] = lambda _: True

    @classmethod
    def of_results(cls, name: str) -> FolderKind:
        """Return the kind of the folders that a command writes as a whole, such as "modes"."""
        return cls(name, "a result", ResultError, lambda folder: is_of_kind(folder, name))


# Ending of a folder's name until it is complete.
UNFINISHED = ".unfinished"


def unfinished_name(target: Path) -> Path:
    """Return where a folder is until it is complete."""
    return target.parent / f"{target.name}{UNFINISHED}"


def require_free(folder: Path, kind: FolderKind, overwrite: bool) -> None:
    """Refuse a folder that a command may not write, before its work."""
    # What a killed command has put aside is still that of the folder.
    place = folder if folder.exists() else replaced_name(folder.resolve())
    if not place.exists():
        require_writable_place(folder, kind.error)
        return
    if not place.is_dir():
        raise kind.error(f"{folder}: expected the name of a folder, got a file")
    _require_kind(place, kind)
    if kind.is_of(place) and kind.is_complete(place) and not overwrite:
        raise kind.error(f"{folder}: holds {kind.content} already: add --overwrite to replace it")


def _require_kind(place: Path, kind: FolderKind) -> None:
    if not is_free(place) and not kind.is_of(place):
        example = min(entry.name for entry in place.iterdir())
        raise kind.error(
            f"{place}: holds files that are not {kind.content} ({example}): name another folder"
        )


@contextmanager
def whole_folder(
    folder: Path,
    kind: FolderKind,
    overwrite: bool,
    keep: Iterable[str] = (),
    who: Callable[[], str] = lambda: "another command writes it",
) -> Iterator[Path]:
    """Give a folder to write into, which becomes `folder` where the block ends well.

    What was listed in it goes where the block fails, and where a command was killed.

    Args:
        keep: Names in it, as of `claim`, that the next attempt finds.

    Raises:
        Exception: That of the kind, if the folder is not free, another command writes it, or it
            cannot be written.
    """
    target, protected = folder.resolve(), tuple(keep)
    draft = unfinished_name(target)
    with exclusively(folder, kind.error, who):
        with writing(folder, kind.error):
            finish_replacement(target)
            require_free(folder, kind, overwrite)
            _require_kind(draft, kind)
            begin_folder(draft, kind.name)
            claim(draft, protected)
            remove_written(draft, keep=protected)
            begin_folder(draft, kind.name)
        try:
            with writing(folder, kind.error):
                yield draft
                for file in listed_files(draft):
                    sync_file(file)
                replace_folder(draft, target)
        except BaseException:  # an interrupt as well
            with suppress(OSError):
                remove_written(draft, keep=protected)
            raise


@contextmanager
def exclusively(
    folder: Path,
    error: type[Exception],
    who: Callable[[], str] = lambda: "another command writes it",
) -> Iterator[None]:
    """Keep other commands from writing a folder; what was killed keeps nobody away.

    Args:
        error: Raised where another command writes it, or no file can be made in it or beside it.

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
    lock = FileLock(target.parent / f".{target.name}.lock")
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
    return target.parent / f".{target.name}.replaced"


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
