"""Reading whole files: devices, pipes, sockets and mistaken names of huge ones are refused."""

from __future__ import annotations

import errno
import os
import stat
from pathlib import Path

from coupling.errors import reason_of


def read_bounded(file: Path, most: int, error: type[Exception]) -> bytes:
    """Return the content of a file.

    Example:
        >>> read_bounded(Path("/dev/zero"), 100, ValueError)
        Traceback (most recent call last):
        ValueError: /dev/zero: expected a file, got a device: name a file
    """
    require_bounded(file, most, error)
    try:
        with file.open("rb") as stream:
            content = stream.read(most + 1)
    except OSError as cause:
        raise error(f"{file}: cannot be read: {reason_of(cause)}") from cause
    if len(content) > most:  # a file of a system, whose size is 0
        raise _too_large(file, most, error)
    return content


def require_bounded(file: Path, most: int, error: type[Exception]) -> None:
    """Refuse what is no file on a disk, or a larger one than `most` [bytes]."""
    try:
        status = file.stat()
        if stat.S_ISDIR(status.st_mode):
            raise OSError(errno.EISDIR, os.strerror(errno.EISDIR))
    except (OSError, ValueError) as cause:  # a name with a null character
        raise error(f"{file}: cannot be read: {reason_of(cause)}") from cause
    for is_kind, kind in _KINDS.items():
        if is_kind(status.st_mode):
            raise error(f"{file}: expected a file, got a {kind}: name a file")
    if status.st_size > most:
        raise _too_large(file, most, error)


# What is no file: it has no end, or waits for one who writes to it, or cannot be read twice.
_KINDS = {
    stat.S_ISCHR: "device",
    stat.S_ISBLK: "device",
    stat.S_ISFIFO: "pipe",
    stat.S_ISSOCK: "socket",
}


def _too_large(file: Path, most: int, error: type[Exception]) -> Exception:
    return error(
        f"{file}: expected a file of at most {most / 1e6:g} MB, got more: is it the right one?"
    )
