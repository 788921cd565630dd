"""The command as a user types it, and what a run folder holds."""

from __future__ import annotations

import subprocess
import sys
from pathlib import Path

FILES = {
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


def command(*arguments: object, cwd: Path | None = None) -> subprocess.CompletedProcess:
    program = [sys.executable, "-m", "coupling.cli", *map(str, arguments)]
    return subprocess.run(
        program, cwd=cwd, capture_output=True, text=True, stdin=subprocess.DEVNULL
    )
