"""Running a program in a folder: output streamed into a file, a time limit, nothing left running.

A program ends with its run: with Ctrl-C and SIGTERM at once.  One whose run was killed is ended by the
next run in the same place, which finds it by a mark in the environment that it has inherited.
"""

from __future__ import annotations

import contextlib
import errno
import os
import signal
import subprocess
import sys
import time
from collections.abc import Sequence
from pathlib import Path
from typing import BinaryIO

from coupling.child_processes import ProcessTree, marked_environment
from coupling.errors import ProcessError, reason_of
from coupling.events import ProcessMessage, Watch, unwatched

OUTPUT = "output.txt"
# Between two looks at a running program [s].
_LOOK = 0.1
# For a program to end on SIGTERM, before it is killed [s].
_GRACE = 2.0
_LAST_LINES = 12
# These are within as much of the output, which may be more than memory holds [bytes].
_LAST_BYTES = 100_000

_NO_INTERPRETER = ": begin a script with #! and its interpreter, or name that first in command"


def run_program(
    command: Sequence[str], folder: Path, time_limit: float, watch: Watch = unwatched
) -> None:
    """Run a command in a folder to its end; what it prints goes to output.txt there.

    Args:
        command: Program and arguments.
        folder: Its working folder.
        time_limit: Longest duration [s]; then the program and all that it started are ended.
        watch: Function called with every line that it prints.

    Raises:
        ProcessError: If it cannot be started, as none can on Windows, takes too long or ends with
            a status other than 0.

    Example:
        >>> import sys, tempfile
        >>> folder = Path(tempfile.mkdtemp())
        >>> run_program([sys.executable, "-c", "print('formed')"], folder, time_limit=60.0)
        >>> last_lines(folder)
        'formed'
    """
    if not hasattr(os, "killpg"):
        raise ProcessError(
            f"{command[0]!r}: expected a system with groups of processes, such as Linux, macOS or WSL,"
            f" got {sys.platform}: run it there, or give the process as an FMU"
        )
    with (folder / OUTPUT).open("wb") as output:
        try:
            program = subprocess.Popen(
                command,
                cwd=folder,
                stdin=subprocess.DEVNULL,
                stdout=output,
                stderr=subprocess.STDOUT,
                start_new_session=True,  # a group of its own, so that its children end with it
                env=marked_environment(_mark_of(folder.parent)),
            )
        except OSError as cause:
            remedy = _NO_INTERPRETER if cause.errno == errno.ENOEXEC else ""
            raise ProcessError(
                f"{command[0]!r} cannot be started: {reason_of(cause)}{remedy}"
            ) from cause
    try:
        _watch_until_end(program, folder / OUTPUT, time_limit, watch)
    finally:
        status = program.poll()
        if status is None:
            _signal_group(program.pid, signal.SIGTERM)
            ProcessTree(program.pid, _mark_of(folder.parent)).end(_GRACE)
            _signal_group(program.pid, signal.SIGKILL)
            program.wait()
    if status != 0:
        raise ProcessError(
            f"{command[0]!r} {_end_in_words(status, time_limit)}{quoted(last_lines(folder))}"
        )


def end_programs(place: Path) -> None:
    """End the programs that a killed run has left in the folders of a place."""
    ProcessTree(None, _mark_of(place)).end(_GRACE)


def last_lines(folder: Path) -> str:
    """Return the end of what the program in a folder has printed."""
    with (folder / OUTPUT).open("rb") as output:
        output.seek(max(output.seek(0, os.SEEK_END) - _LAST_BYTES, 0))
        lines = output.read().decode(errors="replace").rstrip().splitlines()
    return "\n".join(lines[-_LAST_LINES:])


def quoted(lines: str) -> str:
    """Return last lines as the end of an error message."""
    return f"; its last lines:\n{lines}" if lines else "; it printed nothing"


def _watch_until_end(
    program: subprocess.Popen[bytes], file: Path, time_limit: float, watch: Watch
) -> None:
    """Tell the lines of a program's output until it has ended, or the time limit is reached."""
    end = time.monotonic() + time_limit
    with file.open("rb") as output:
        while (remaining := end - time.monotonic()) > 0.0:
            with contextlib.suppress(subprocess.TimeoutExpired):
                program.wait(min(_LOOK, remaining))
                return
            _report(output, watch)


def _report(output: BinaryIO, watch: Watch) -> None:
    for line in output.readlines():
        watch(ProcessMessage(line.decode(errors="replace").rstrip()))


def _end_in_words(status: int | None, time_limit: float) -> str:
    """Return how a program has ended; its status is None where it was ended."""
    if status is None:
        return f"was ended after the time limit of {time_limit:g} s"
    if status < 0:
        return f"was ended by {signal.strsignal(-status)} (signal {-status})"
    return f"ended with exit status {status}"


def _mark_of(place: Path) -> str:
    """Return the mark of all that programs in the folders of a place start."""
    return str(place.resolve())


def _signal_group(group: int, number: signal.Signals) -> None:
    with contextlib.suppress(ProcessLookupError, PermissionError):
        os.killpg(group, number)
