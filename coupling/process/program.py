"""Running a program in a folder: output streamed into a file, a time limit, nothing left running."""

from __future__ import annotations

import contextlib
import os
import signal
import subprocess
import time
from collections.abc import Sequence
from pathlib import Path
from typing import BinaryIO

from coupling.errors import ProcessError
from coupling.events import Said, Watch, unwatched

OUTPUT = "output.txt"
# Between two looks at a running program [s].
_LOOK = 0.1
# For a program that is told to end, before it is killed [s].
_GRACE = 2.0
_LAST_LINES = 12


def run_program(
    command: Sequence[str], folder: Path, time_limit: float, watch: Watch = unwatched
) -> None:
    """Run a command in a folder to its end; what it prints goes to output.txt there.

    Args:
        command: Program and arguments.
        folder: Its working folder.
        time_limit: [s]; then the program and all that it started are ended.
        watch: Function that is told every line that it prints.

    Raises:
        ProcessError: If it cannot be started, takes too long or ends with a status other than 0.

    Example:
        >>> import sys, tempfile
        >>> folder = Path(tempfile.mkdtemp())
        >>> run_program([sys.executable, "-c", "print('formed')"], folder, time_limit=60.0)
        >>> last_lines(folder)
        'formed'
    """
    with (folder / OUTPUT).open("wb") as output, (folder / OUTPUT).open("rb") as said:
        try:
            process = subprocess.Popen(
                command,
                cwd=folder,
                stdin=subprocess.DEVNULL,
                stdout=output,
                stderr=subprocess.STDOUT,
                start_new_session=True,  # a group of its own, so that its children end with it
            )
        except OSError as cause:
            raise ProcessError(
                f"{command[0]!r} cannot be started: {cause.strerror or cause}"
            ) from cause
        try:
            status = _watch(process, said, time_limit, watch)
        finally:
            if process.returncode is None:
                _end_group(process)
    if status is None:
        raise ProcessError(
            f"{command[0]!r} was ended after the time limit of {time_limit:g} s"
            f"{quoted(last_lines(folder))}"
        )
    if status != 0:
        raise ProcessError(
            f"{command[0]!r} ended with exit status {status}{quoted(last_lines(folder))}"
        )


def last_lines(folder: Path) -> str:
    """Return the end of what the program in a folder has printed."""
    lines = (folder / OUTPUT).read_text(encoding="utf-8", errors="replace").rstrip().splitlines()
    return "\n".join(lines[-_LAST_LINES:])


def quoted(lines: str) -> str:
    """Return last lines as the end of an error message."""
    return f"; its last lines:\n{lines}" if lines else "; it printed nothing"


def _watch(
    process: subprocess.Popen[bytes], said: BinaryIO, time_limit: float, watch: Watch
) -> int | None:
    """Return the exit status, or None where the time limit came first."""
    end = time.monotonic() + time_limit
    while (left := end - time.monotonic()) > 0.0:
        with contextlib.suppress(subprocess.TimeoutExpired):
            return process.wait(min(_LOOK, left))
        for line in said.readlines():
            watch(Said(line.decode(errors="replace").rstrip()))
    return None


def _end_group(process: subprocess.Popen[bytes]) -> None:
    with contextlib.suppress(ProcessLookupError):
        os.killpg(process.pid, signal.SIGTERM)
        with contextlib.suppress(subprocess.TimeoutExpired):
            process.wait(_GRACE)
        os.killpg(process.pid, signal.SIGKILL)
    process.wait()
