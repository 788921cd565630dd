"""Files that are there whole or not at all, whatever ends the program or the machine."""

from __future__ import annotations

import errno
import os
import re
import time
import uuid
from collections.abc import Iterable, Iterator
from contextlib import contextmanager, suppress
from pathlib import Path

from coupling.errors import reason_of

try:
    import fcntl
except ImportError:  # Windows
    fcntl = None  # type: ignore[assignment]

# Ending of a file that is not complete yet.
PARTIAL = ".partial"
# Name of such a file, from that of the whole one.
DRAFT = re.compile(rf"(.+)\.[0-9a-f]{{32}}{re.escape(PARTIAL)}")
# Without locks, a draft that nobody has written to for so long is of a killed command [s].
_STALE = 60.0


class AtomicFile:
    """A file under a temporary name beside its own, which it gets when it is complete and on the disk.

    Args:
        file: The file; one that is there is replaced, behind a link the one that the link leads to.
        room: Room to take at once [bytes], so that a full disk is found before the work that fills it.

    Raises:
        OSError: If it cannot be made, there is less room, or a folder or a device has the name.

    Example:
        >>> import tempfile
        >>> file = Path(tempfile.mkdtemp(), "figures.json")
        >>> AtomicFile(file).write([b"{", b"}"])
        >>> file.read_bytes()
        b'{}'
    """

    def __init__(self, file: Path, room: int = 0) -> None:
        self._file = file = Path(os.path.realpath(file))
        # Who may do all would get a file in the place of /dev/null.
        if file.exists() and not file.is_file():
            kind = "folder" if file.is_dir() else "device or pipe"
            raise OSError(errno.EEXIST, f"expected a file or a new name, got a {kind}")
        _remove_abandoned_drafts(file)
        while True:
            self._draft = file.with_name(f"{file.name}.{uuid.uuid4().hex}{PARTIAL}")
            self._stream = self._draft.open("xb")
            _lock(self._stream.fileno())
            if self._draft.exists():  # else another command took it for abandoned before the lock
                break
            self._stream.close()
        try:
            if room and hasattr(os, "posix_fallocate"):
                os.posix_fallocate(self._stream.fileno(), 0, room)
        except BaseException:
            self.discard()
            raise

    def write(self, parts: Iterable[bytes | memoryview]) -> None:
        """Write the content; afterwards the file is there under its name.

        Raises:
            OSError: If it cannot be written; what was there before is then untouched.
        """
        try:
            for part in parts:
                self._stream.write(part)
            self._stream.truncate()
            self._stream.flush()
            os.fsync(self._stream.fileno())
            if fcntl is None:  # no file that is open can be renamed
                self._stream.close()
            os.replace(self._draft, self._file)
            self._stream.close()
        except BaseException:
            self.discard()
            raise
        sync_folder(self._file.parent)

    def discard(self) -> None:
        """Remove what is there under the temporary name, if anything is."""
        with suppress(OSError):  # closing writes what is left, and a full disk refuses
            self._stream.close()
        with suppress(OSError):
            self._draft.unlink()


def _lock(number: int) -> None:
    """Lock an open file as long as it is open, where the system can."""
    if fcntl is not None:
        with suppress(OSError):
            fcntl.flock(number, fcntl.LOCK_EX)


def _remove_abandoned_drafts(file: Path) -> None:
    """Remove what killed commands have left of a file under temporary names."""
    with suppress(OSError):
        for draft in list(file.parent.glob(f"*{PARTIAL}")):
            name = DRAFT.fullmatch(draft.name)
            if name is not None and name[1] == file.name:
                remove_abandoned(draft)


def remove_abandoned(draft: Path) -> None:
    """Remove a file under a temporary name, unless a program that may still write it has it open."""
    with suppress(OSError):
        if fcntl is not None:
            with draft.open("rb") as stream:
                fcntl.flock(stream.fileno(), fcntl.LOCK_EX | fcntl.LOCK_NB)
                draft.unlink()
        # Windows removes no file that is open, but one is closed for a moment before it is renamed.
        elif time.time() - draft.stat().st_mtime > _STALE:
            draft.unlink()


def sync_file(file: Path) -> None:
    """Bring a file to the disk, where the system can."""
    with file.open("rb") as stream, suppress(OSError):
        os.fsync(stream.fileno())


def sync_folder(folder: Path) -> None:
    """Bring the names in a folder to the disk, where the system can."""
    with suppress(OSError):  # not every file system knows this of folders
        number = os.open(folder, os.O_RDONLY)
        try:
            os.fsync(number)
        finally:
            os.close(number)


@contextmanager
def writing(place: Path, error: type[Exception]) -> Iterator[None]:
    """Have what cannot be written raise `error`, with the place's name.

    Connections to other programs that end are no fault of the place.
    """
    try:
        yield
    except OSError as cause:
        if cause.errno is None or isinstance(cause, ConnectionError | TimeoutError):
            raise
        raise error(f"{place}: cannot be written: {reason_of(cause)}") from cause


def write_atomically(file: Path, text: str, error: type[Exception]) -> None:
    """Write a text as a whole file; `error` is raised with the file's name if that fails."""
    with writing(file, error):
        AtomicFile(file).write([text.encode("utf-8")])


def require_writable_place(place: Path, error: type[Exception]) -> None:
    """Refuse a file or folder that cannot be made, before the work whose result it holds."""
    above = next(parent for parent in place.resolve().parents if parent.exists())
    if not (above.is_dir() and os.access(above, os.W_OK | os.X_OK)):
        raise error(
            f"{place}: cannot be made: {above} is no folder to write into: name another place (--output)"
        )


def make_folder_of(file: Path, error: type[Exception]) -> None:
    """Make the folder of a file that is to be written."""
    try:
        file.parent.mkdir(parents=True, exist_ok=True)
    except OSError as cause:
        raise error(f"{file.parent}: cannot be made: {reason_of(cause)}") from cause
