"""The command as a user types it, and what a run folder holds."""

import subprocess
import sys
from contextlib import redirect_stderr, redirect_stdout
from io import StringIO

import pytest

FILES = {
    ".elastic-robot.json",
    "case.toml",
    "result.json",
    "run.json",
    "desired.csv",
    "uncompensated.csv",
    "achieved.csv",
    "command.csv",
    "correction.csv",
    "wrench.csv",
    "report.html",
}
# What a run in one mode leaves of the robot in the other one.
BY_MODE = {
    mode: {f"{path}_{mode}.csv" for path in ("uncompensated", "achieved")}
    for mode in ("dynamic", "quasistatic")
}


def command(*arguments: object, exits: int | None = None) -> subprocess.CompletedProcess[str]:
    """Run the command line in this process: importing all takes longer than it works.

    Args:
        exits: Exit status that it must have; None for any.
    """
    with redirect_stdout(StringIO()) as out, redirect_stderr(StringIO()) as err:
        code = status(*arguments)
    done = subprocess.CompletedProcess(arguments, code, out.getvalue(), err.getvalue())
    return _require(done, exits)


def status(*arguments: object) -> int:
    """Return the exit status of the command line in this process, which prints."""
    from coupling.cli import main

    with pytest.raises(SystemExit) as end:
        main([str(argument) for argument in arguments])
    return int(end.value.code or 0)


def program(*arguments: object, exits: int | None = None) -> subprocess.CompletedProcess[str]:
    """Run it in a process of its own, where workers are started or the environment is another one.

    Args:
        exits: Exit status that it must have; None for any.
    """
    typed = [sys.executable, "-m", "coupling.cli", *map(str, arguments)]
    done = subprocess.run(typed, capture_output=True, text=True, stdin=subprocess.DEVNULL)
    return _require(done, exits)


def _require(
    done: subprocess.CompletedProcess[str], exits: int | None
) -> subprocess.CompletedProcess[str]:
    assert exits in (None, done.returncode), (done.returncode, done.stdout + done.stderr)
    return done
