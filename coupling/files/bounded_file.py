"""Reading whole files that may be endless: devices, pipes, and mistaken names of huge ones."""

from __future__ import annotations

import errno
import os
import stat
from pathlib import Path

from coupling.errors import reason_of


def read_bounded(file: Path, most: int, error: type[Exception]) -> bytes:
    """Return the content of a file or pipe.

    Args:
        file: The file.
        most: Largest size that any such file has [bytes].
        error: Exception class for every problem, with the file's name.

    Example:
        >>> read_bounded(Path("/dev/zero"), 100, ValueError)
        Traceback (most recent call last):
        ValueError: /dev/zero: expected a file, got a device: name a file
    """
    try:
        mode = file.stat().st_mode
        with file.open("rb") as stream:
            content = b"" if _is_device(mode) else stream.read(most + 1)
    except (OSError, ValueError) as cause:  # a name with a null character
        raise error(f"{file}: cannot be read: {reason_of(cause)}") from cause
    _require_no_device(file, mode, error)
    if len(content) > most:
        raise _too_large(file, most, error)
    return content


def require_bounded(file: Path, most: int, error: type[Exception]) -> None:
    """Refuse what is no file on a disk, or a larger one than `most` [bytes].

    Raises:
        Exception: The error that is given; also where there is no such file.
    """
    try:
        status = file.stat()
        if stat.S_ISDIR(status.st_mode):
            raise OSError(errno.EISDIR, os.strerror(errno.EISDIR))
    except (OSError, ValueError) as cause:
        raise error(f"{file}: cannot be read: {reason_of(cause)}") from cause
    _require_no_device(file, status.st_mode, error)
    if stat.S_ISFIFO(
        status.st_mode
    ):  # is read again for its numbers, and one nobody writes to waits
        raise error(f"{file}: expected a file, got a pipe, which cannot be read twice")
    if status.st_size > most:
        raise _too_large(file, most, error)


def _is_device(mode: int) -> bool:
    return stat.S_ISCHR(mode) or stat.S_ISBLK(mode)  # many of which have no end


def _require_no_device(file: Path, mode: int, error: type[Exception]) -> None:
    if _is_device(mode):
        raise error(f"{file}: expected a file, got a device: name a file")


def _too_large(file: Path, most: int, error: type[Exception]) -> Exception:
    return error(
        f"{file}: expected a file of at most {most / 1e6:g} MB, got more: is it the right one?"
    )
