"""One command at a time writes a folder."""

from __future__ import annotations

import os
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from pathlib import Path

from filelock import FileLock, Timeout


@contextmanager
def alone(folder: Path, error: type[Exception]) -> Iterator[None]:
    """Keep other commands from writing a folder; what was killed keeps nobody away.

    Args:
        folder: The folder, which need not be there; the one that it is in is made.
        error: Raised where another command writes it, or no file can be made beside it.

    Example:
        >>> import tempfile
        >>> folder = Path(tempfile.mkdtemp(), "made")
        >>> with alone(folder, ValueError):
        ...     try:
        ...         alone(folder, ValueError).__enter__()
        ...     except ValueError as error:
        ...         print(str(error).partition(": ")[2])
        another command writes it: wait for its end, or name another folder
    """
    target = folder.resolve()
    lock = FileLock(target.with_name(f".{target.name}.lock"))
    try:
        target.parent.mkdir(parents=True, exist_ok=True)
        lock.acquire(timeout=0)
    except Timeout:
        raise error(
            f"{folder}: another command writes it: wait for its end, or name another folder"
        ) from None
    except OSError as cause:
        raise error(f"{folder}: cannot be written: {cause.strerror or cause}") from cause
    try:
        yield
    finally:
        with suppress(OSError):
            os.unlink(lock.lock_file)
        lock.release()
