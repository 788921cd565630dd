"""Folders for temporary files that the next run removes where their owner was killed."""

from __future__ import annotations

import shutil
import tempfile
import time
import weakref
from contextlib import suppress
from pathlib import Path

from filelock import FileLock, Timeout

_PREFIX, _LOCK_SUFFIX = "elastic_robot_", ".owned"
# A folder younger than this may not be locked yet [s].
_UNLOCKED_AGE = 60.0


class ScratchFolder:
    """A temporary folder, removed when it is closed or its process ends; a context manager.

    Example:
        >>> with ScratchFolder() as scratch:
        ...     _ = (scratch / "robot.fmu").write_bytes(b"")
        >>> scratch.exists()
        False
    """

    def __init__(self) -> None:
        self.path = Path(tempfile.mkdtemp(prefix=_PREFIX))
        lock = FileLock(self.path / _LOCK_SUFFIX)
        lock.acquire()
        self._close = weakref.finalize(self, _remove, self.path, lock)

    def __enter__(self) -> Path:
        return self.path

    def __exit__(self, *error: object) -> None:
        self.close()

    def close(self) -> None:
        """Remove the folder."""
        self._close()


def _remove(folder: Path, lock: FileLock) -> None:
    lock.release()
    shutil.rmtree(folder, ignore_errors=True)


def remove_abandoned() -> None:
    """Remove the folders of processes that were killed."""
    for owned in Path(tempfile.gettempdir()).glob(f"{_PREFIX}*/{_LOCK_SUFFIX}"):
        with suppress(OSError, Timeout):  # another user's, or in use
            if time.time() - owned.stat().st_mtime > _UNLOCKED_AGE:
                with FileLock(owned).acquire(timeout=0):
                    shutil.rmtree(owned.parent, ignore_errors=True)
