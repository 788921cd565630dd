"""The folder that keeps answers: one file each, shared by runs, studies and machines."""

from __future__ import annotations

import json
import os
import platform
import re
import time
from collections.abc import Iterator, Sequence
from contextlib import contextmanager, suppress
from dataclasses import dataclass
from datetime import datetime
from pathlib import Path

from filelock import FileLock, Timeout

from coupling.errors import StoreError, reason_of
from coupling.events import Event, WarningEvent, Watch, unwatched
from coupling.files.atomic_file import PARTIAL, AtomicFile
from coupling.path.histories import ToolPath
from coupling.process.base import ProcessResponse
from coupling.process.validation import find_misfit
from coupling.store.entry import (
    DamagedError,
    EntryInfo,
    decode_response,
    encode_response,
    read_about,
)

ENTRY, DAMAGED = ".npz", ".damaged"
# Folder in the store for the locks of keys, and for who holds them.
LOCKS = "locks"
_KEY = re.compile(r"[0-9a-f]{64}")
# Between two looks at a lock that another one holds [s].
_LOOK = 0.1


@dataclass(frozen=True)
class WaitingForOther(Event):
    """Another process computes the same evaluation; this one waits for its answer."""

    text: str


@dataclass(frozen=True)
class Entry:
    """An answer in the store.

    Attributes:
        used: When it was written or last used [s since 1970].
        about: Its description; None where it cannot be read.
    """

    file: Path
    size: int
    used: float
    about: EntryInfo | None

    @property
    def key(self) -> str:
        """Its key."""
        return self.file.name.removesuffix(ENTRY)

    def problem(self) -> str:
        """Return what is wrong with it, empty if nothing is."""
        try:
            decode_response(self.file.read_bytes(), self.key)
        except DamagedError as cause:
            return str(cause)
        except OSError as cause:
            return f"cannot be read: {reason_of(cause)}"
        return ""


@dataclass(frozen=True)
class Store:
    """A folder of answers by key; made when the first one is written.

    Attributes:
        watch: Function called with damaged entries, and what is waited for.
    """

    folder: Path
    watch: Watch = unwatched

    def entries(self) -> list[Entry]:
        """Return what is in the store, the entry that was used last at the end."""
        readable = []
        with self._errors("read"):
            for file in self.folder.iterdir():
                if file.name.endswith(ENTRY) and _KEY.fullmatch(file.name.removesuffix(ENTRY)):
                    with suppress(FileNotFoundError):  # cleared in the meantime
                        readable.append(_entry(file))
        return sorted(readable, key=lambda entry: entry.used)

    def read(self, key: str, path: ToolPath) -> ProcessResponse | None:
        """Return the answer to a path that is kept under a key, or None where none is sound."""
        with suppress(DamagedError):
            return self._read(key, path)
        return None

    def about(self, key: str) -> EntryInfo | None:
        """Return what the answer that is kept under a key says about itself, if there is one."""
        return read_about(self._file(key))

    @contextmanager
    def claimed(self, key: str, path: ToolPath) -> Iterator[ProcessResponse | None]:
        """Hold a key while its answer is computed; another process that needs it waits meanwhile.

        Gives the answer where it has come in the meantime.  An entry that is damaged is set aside.
        """
        with self._errors("written"):
            (self.folder / LOCKS).mkdir(parents=True, exist_ok=True)
            lock = FileLock(self._lock(key))
            owner = self._lock(key).with_suffix(".owner")
            self._acquire(lock, owner)
        try:
            with suppress(OSError):  # only read by those who wait
                owner.write_text(json.dumps([platform.node(), os.getpid(), time.time()]))
            yield self._sound(key, path)
        finally:
            with suppress(OSError):
                owner.unlink()
            lock.release()

    def room(self, key: str, size: int) -> AtomicFile:
        """Take room for an answer before it is computed; its key is to be held."""
        with self._errors("written"):
            for draft in self.folder.glob(f"{key}{ENTRY}.*{PARTIAL}"):
                draft.unlink(missing_ok=True)  # of a process that was killed
            return AtomicFile(self._file(key), size)

    def write(self, file: AtomicFile, response: ProcessResponse, about: EntryInfo) -> None:
        """Keep an answer, in the room that was taken for it."""
        with self._errors("written"):
            try:
                file.write([encode_response(response, about)])
            except TypeError as cause:
                file.discard()
                raise StoreError(f"the result cannot be kept: {cause}") from cause

    def clear(self, entries: Sequence[Entry]) -> None:
        """Remove entries, entries that were set aside, and what killed processes have left."""
        with self._errors("cleared"):
            for entry in entries:
                entry.file.unlink(missing_ok=True)
            for pattern in (f"*{ENTRY}.*{PARTIAL}", f"*{DAMAGED}"):
                for file in self.folder.glob(pattern):
                    lock = FileLock(self._lock(file.name.split(".")[0]))
                    with suppress(Timeout), lock.acquire(timeout=0):
                        file.unlink(missing_ok=True)
            for file in (self.folder / LOCKS).glob("*.lock"):
                with suppress(Timeout), FileLock(file).acquire(timeout=0):
                    file.unlink()
                    file.with_suffix(".owner").unlink(missing_ok=True)

    def _read(self, key: str, path: ToolPath) -> ProcessResponse | None:
        try:
            response = decode_response(self._file(key).read_bytes(), key)
        except FileNotFoundError:
            return None
        except OSError as cause:
            raise StoreError(f"{self._file(key)}: cannot be read: {reason_of(cause)}") from cause
        problem = find_misfit(response, path)
        if problem:
            raise DamagedError(f"is no answer to its path: {problem}")
        with suppress(OSError):  # a store that may only be read
            os.utime(self._file(key))
        return response

    def _sound(self, key: str, path: ToolPath) -> ProcessResponse | None:
        """Return the answer that is kept, and set a damaged entry aside."""
        try:
            return self._read(key, path)
        except DamagedError as cause:
            file = self._file(key)
            aside = file.with_suffix(DAMAGED)
            with self._errors("written"):
                os.replace(file, aside)
            text = f"{file}: {cause}: it is set aside as {aside.name} and computed again"
            self.watch(WarningEvent(text))
        return None

    def _acquire(self, lock: FileLock, owner: Path) -> None:
        try:
            lock.acquire(timeout=0)
            return
        except Timeout:
            self.watch(
                WaitingForOther(f"waiting for {_owner(owner)}, which computes the same evaluation")
            )
        lock.acquire(timeout=-1, poll_interval=_LOOK)

    def _file(self, key: str) -> Path:
        return self.folder / f"{key}{ENTRY}"

    def _lock(self, key: str) -> Path:
        return self.folder / LOCKS / f"{key}.lock"

    @contextmanager
    def _errors(self, what: str) -> Iterator[None]:
        try:
            yield
        except OSError as cause:
            reason = reason_of(cause)
            raise StoreError(f"{self.folder}: the store cannot be {what}: {reason}") from cause


def to_clear(
    entries: Sequence[Entry], now: float, older_than: float | None, keep: int | None
) -> list[Entry]:
    """Return the entries to remove: those not used for a time, and the oldest beyond a size.

    Args:
        now: [s since 1970].
        older_than: Time without use after which an entry goes [s]; None: none goes for its age.
        keep: Size of the entries that may stay [bytes]; None: any.

    Example:
        >>> entries = [Entry(Path(f"{k}"), 10, float(k), None) for k in range(4)]
        >>> [entry.file.name for entry in to_clear(entries, 4.0, 2.5, None)]
        ['0', '1']
        >>> [entry.file.name for entry in to_clear(entries, 4.0, None, 25)]
        ['0', '1']
    """
    size = sum(entry.size for entry in entries)
    oldest = []
    for entry in entries:
        too_old = older_than is not None and now - entry.used > older_than
        too_much = keep is not None and size > keep
        if too_old or too_much:
            oldest.append(entry)
            size -= entry.size
    return oldest


def _entry(file: Path) -> Entry:
    status = file.stat()
    return Entry(file, status.st_size, status.st_mtime, read_about(file))


def _owner(file: Path) -> str:
    """Return who holds a lock, in words."""
    try:
        host, process, since = json.loads(file.read_text())
        moment = datetime.fromtimestamp(float(since)).strftime("%Y-%m-%d %H:%M:%S")
    except (OSError, ValueError, TypeError):
        return "another process"
    return f"process {process} on {host}, since {moment}"
