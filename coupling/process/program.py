"""Running a program in a folder: output streamed into a file, a time limit, nothing left running.

The program runs under a shell of its own, which writes its exit status into the folder.  So the end of
a program is known even where who started it was killed, and whoever comes next can wait for it: the
shell's standard input is a file that it holds locked to its end.  Windows has neither such a shell nor
locks that a program inherits: there no program is started.
"""

from __future__ import annotations

import contextlib
import os
import shutil
import signal
import subprocess
import sys
import time
from collections.abc import Callable, Sequence
from pathlib import Path
from typing import BinaryIO

from coupling.errors import ProcessError
from coupling.events import ProcessMessage, Watch, unwatched
from coupling.process_tree import ProcessTree, marked_environment

try:
    import fcntl
except ImportError:  # not a POSIX system
    _HAS_LOCKS = False
else:
    _HAS_LOCKS = True

OUTPUT = "output.txt"
STATUS = "exit_status"
# Locked by the shell while the program runs; holds the shell's number, which is that of its group.
RUNNING = "running"
# A program that gets SIGTERM may clean up: the shell outlives it (trap) and writes its status.
# What the shell itself has to say of a program's end is not part of the program's output (2).
_SHELL = (
    'trap : TERM; echo $$ > "$0"; exec 3>&2 2> /dev/null; "$@" < /dev/null 2>&3 3>&-;'
    f" echo $? > {STATUS}.partial; mv -f {STATUS}.partial {STATUS}"
)
# Between two looks at a running program [s].
_LOOK = 0.1
# For a program to end on SIGTERM, before it is killed [s].
_GRACE = 2.0
_LAST_LINES = 12
# These are within as much of the output, which may be more than memory holds [bytes].
_LAST_BYTES = 100_000


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
    if not _HAS_LOCKS:
        raise ProcessError(
            f"{command[0]!r}: expected a system with a POSIX shell and file locks, such as Linux, macOS"
            f" or WSL, got {sys.platform}: run it there, or give the process as an FMU"
        )
    if shutil.which(command[0], path=None) is None and not (folder / command[0]).is_file():
        raise ProcessError(f"{command[0]!r} cannot be started: there is no such program")
    with (folder / RUNNING).open("w+b") as lock, (folder / OUTPUT).open("wb") as output:
        with contextlib.suppress(OSError):  # a file system without locks
            fcntl.flock(lock, fcntl.LOCK_EX | fcntl.LOCK_NB)
        shell = subprocess.Popen(
            ["/bin/sh", "-c", _SHELL, RUNNING, *command],
            cwd=folder,
            stdin=lock,
            stdout=output,
            stderr=subprocess.STDOUT,
            start_new_session=True,  # a group of its own, so that its children end with it
            env=marked_environment(_mark_of(folder)),
        )
    try:
        ended = _watched(folder, time_limit, watch, lambda wait: _ends(shell, wait))
    finally:
        if shell.returncode is None:
            _end_all(shell.pid, folder, lambda wait: _ends(shell, wait))
            shell.wait()
    require_success(command[0], folder, time_limit if not ended else None)


def is_running(folder: Path) -> bool:
    """Return whether a program that someone else started still runs in a folder."""
    if not _HAS_LOCKS:  # where none can be started
        return False
    try:
        with (folder / RUNNING).open("rb") as lock:
            fcntl.flock(lock, fcntl.LOCK_EX | fcntl.LOCK_NB)
    except BlockingIOError:
        return True
    except OSError:  # never started, or a file system without locks
        return False
    return False


def wait_for_program(name: str, folder: Path, time_limit: float, watch: Watch = unwatched) -> None:
    """Wait for a program that someone else started in a folder, as `run_program` does.

    Args:
        name: Its name.
        folder, time_limit, watch: As for `run_program`; the time counts from now.

    Raises:
        ProcessError: As `run_program`.
    """
    ended = False
    try:
        ended = _watched(folder, time_limit, watch, lambda wait: _has_gone(folder, wait))
    finally:
        if not ended:
            end_program(folder)
    require_success(name, folder, time_limit if not ended else None)


def end_program(folder: Path) -> None:
    """End the program that someone else started in a folder, if it still runs."""
    if is_running(folder):
        with contextlib.suppress(OSError, ValueError):  # it has just ended
            group = int((folder / RUNNING).read_text())
            _end_all(group, folder, lambda wait: _has_gone(folder, wait))


def has_ended(folder: Path) -> bool:
    """Return whether the program in a folder has come to its end, by itself or by a signal."""
    return (folder / STATUS).is_file()


def require_success(name: str, folder: Path, overdue: float | None = None) -> None:
    """Check how the program in a folder has ended.

    Args:
        name: Its name.
        folder: Its working folder.
        overdue: Time limit after which it was ended [s], if it was.

    Raises:
        ProcessError: With its last lines, unless it ended with status 0.
    """
    said = quoted(last_lines(folder))
    if overdue is not None:
        raise ProcessError(f"{name!r} was ended after the time limit of {overdue:g} s{said}")
    try:
        status = (folder / STATUS).read_text().strip()
    except OSError as cause:
        raise ProcessError(f"{name!r} was killed with all that ran it{said}") from cause
    if status != "0":
        raise ProcessError(f"{name!r} ended with exit status {status}{said}")


def last_lines(folder: Path) -> str:
    """Return the end of what the program in a folder has printed."""
    with (folder / OUTPUT).open("rb") as said:
        said.seek(max(said.seek(0, os.SEEK_END) - _LAST_BYTES, 0))
        lines = said.read().decode(errors="replace").rstrip().splitlines()
    return "\n".join(lines[-_LAST_LINES:])


def quoted(lines: str) -> str:
    """Return last lines as the end of an error message."""
    return f"; its last lines:\n{lines}" if lines else "; it printed nothing"


def _watched(folder: Path, time_limit: float, watch: Watch, ends: Callable[[float], bool]) -> bool:
    """Tell what a program prints until it ends; return whether it did within the time limit."""
    end = time.monotonic() + time_limit
    with (folder / OUTPUT).open("rb") as said:
        while (remaining := end - time.monotonic()) > 0.0:
            if ends(min(_LOOK, remaining)):
                return True
            _report(said, watch)
    return False


def _report(said: BinaryIO, watch: Watch) -> None:
    for line in said.readlines():
        watch(ProcessMessage(line.decode(errors="replace").rstrip()))


def _ends(shell: subprocess.Popen[bytes], wait: float) -> bool:
    with contextlib.suppress(subprocess.TimeoutExpired):
        shell.wait(wait)
        return True
    return False


def _has_gone(folder: Path, wait: float) -> bool:
    time.sleep(wait)
    return not is_running(folder)


def _mark_of(folder: Path) -> str:
    """Return the mark of what a program in a folder starts; whoever comes next finds it by that too."""
    return str(folder.resolve())


def _end_all(group: int, folder: Path, ends: Callable[[float], bool]) -> None:
    """Tell a shell and all that it has started to end, and kill what has not done so after a grace."""
    if group <= 1:
        return
    started = ProcessTree(group, _mark_of(folder))
    started.terminate()
    _signal_group(group, signal.SIGTERM)
    end = time.monotonic() + _GRACE
    while time.monotonic() < end and not (ends(_LOOK) and not started.is_running):
        time.sleep(_LOOK)
    _signal_group(group, signal.SIGKILL)
    started.kill()


def _signal_group(group: int, number: signal.Signals) -> None:
    with contextlib.suppress(ProcessLookupError, PermissionError):
        os.killpg(group, number)
