"""The command as a user types it, and what a run folder holds."""

from __future__ import annotations

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


def command(*arguments: object) -> subprocess.CompletedProcess[str]:
    """Run the command line in this process: importing all takes longer than it works."""
    with redirect_stdout(StringIO()) as out, redirect_stderr(StringIO()) as err:
        code = status(*arguments)
    return subprocess.CompletedProcess(arguments, code, out.getvalue(), err.getvalue())


def status(*arguments: object) -> int:
    """Return the exit status of the command line in this process, which prints."""
    from coupling.cli import main

    with pytest.raises(SystemExit) as end:
        main([str(argument) for argument in arguments])
    return int(end.value.code or 0)


def program(*arguments: object) -> subprocess.CompletedProcess[str]:
    """Run it in a process of its own, where workers are started or the environment is another one."""
    typed = [sys.executable, "-m", "coupling.cli", *map(str, arguments)]
    return subprocess.run(typed, capture_output=True, text=True, stdin=subprocess.DEVNULL)
