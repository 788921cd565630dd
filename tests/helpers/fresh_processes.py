"""Processes that have not imported the project and need not wait for imports."""

import json
import os
import subprocess
import sys
import tempfile
from collections.abc import Mapping, Sequence
from pathlib import Path
from subprocess import PIPE, CompletedProcess
from typing import Self

from places import HOSTS


class Fresh:
    """The process of tests/fmu/hosts/fresh.py, from which others are forked.

    Args:
        modules: What they have loaded.
        environment: Of the process; its own if it is None.
    """

    def __init__(self, *modules: str, environment: Mapping[str, str] | None = None) -> None:
        command = [sys.executable, str(HOSTS / "fresh.py"), *modules]
        self._process = subprocess.Popen(
            command, stdin=PIPE, stdout=PIPE, text=True, bufsize=1, env=environment
        )

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *error: object) -> None:
        self._process.__exit__(*error)

    def run(
        self, command: Sequence[str], folder: Path, environment: Mapping[str, str] = os.environ
    ) -> CompletedProcess[str]:
        """Run a script with its arguments in a folder; return what it says."""
        with tempfile.NamedTemporaryFile() as out, tempfile.NamedTemporaryFile() as err:
            order = {
                "command": list(command),
                "folder": str(folder),
                "environment": dict(environment),
                "stdout": out.name,
                "stderr": err.name,
            }
            self._process.stdin.write(json.dumps(order) + "\n")
            code = int(self._process.stdout.readline())
            said = out.read().decode(), err.read().decode()
        return CompletedProcess(command, code, *said)
