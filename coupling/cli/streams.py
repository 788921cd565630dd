"""Standard streams that a command outlasts: closed, on a full disk, of a reader that goes, in ASCII."""

from __future__ import annotations

import io
import os
import sys
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from typing import Any


class LastingStream:
    """A stream of text whose failures do not end the command, which still writes its files.

    Attributes:
        failure: Reason for which text was lost; None where none was, or its reader wanted no more.
    """

    def __init__(self, stream: Any) -> None:
        self._stream = stream
        self.failure: OSError | ValueError | None = None

    def __getattr__(self, name: str) -> Any:
        return getattr(self._stream, name)

    def write(self, text: str) -> int:
        """Write a text, or lose it."""
        try:
            return int(self._stream.write(text))
        except (OSError, ValueError) as cause:  # a plugin may have closed it
            self._give_up(cause)
            return len(text)

    def flush(self) -> None:
        """Write what is kept back, or lose it."""
        try:
            self._stream.flush()
        except (OSError, ValueError) as cause:  # a plugin may have closed it
            self._give_up(cause)

    def _give_up(self, cause: OSError | ValueError) -> None:
        """Write to nothing from now on: what is kept back would fail again at the end of Python."""
        if not isinstance(cause, BrokenPipeError):
            self.failure = cause
        with suppress(OSError, ValueError), open(os.devnull, "wb") as nothing:
            os.dup2(nothing.fileno(), self._stream.fileno())


@contextmanager
def lasting_streams() -> Iterator[LastingStream]:
    """Let standard output and standard error fail without harm; gives standard output."""
    _open_closed()
    streams = sys.stdout, sys.stderr
    for stream in streams:
        if isinstance(
            stream, io.TextIOWrapper
        ):  # characters that its encoding lacks are written out
            stream.reconfigure(errors="backslashreplace")
    output, errors = map(LastingStream, streams)
    sys.stdout, sys.stderr = output, errors
    try:
        yield output
    finally:
        output.flush()
        errors.flush()
        sys.stdout, sys.stderr = streams


def _open_closed() -> None:
    """Open standard streams that a daemon was started without: other files would get their numbers."""
    for number, name in enumerate(("stdin", "stdout", "stderr")):
        try:
            os.fstat(number)
        except OSError:
            with suppress(OSError):
                os.set_inheritable(os.open(os.devnull, os.O_RDWR), True)
        if getattr(sys, name) is None:
            mode = "w" if number else "r"
            setattr(sys, name, open(os.devnull, mode, encoding="utf-8"))  # noqa: SIM115
