"""The robot as an FMU: simulations in a process of their own, as plain function calls."""

from __future__ import annotations

import os
import pickle
import re
import subprocess
import sys
import tempfile
from collections.abc import Callable
from pathlib import Path
from types import TracebackType
from typing import Any

import fmpy
import numpy as np

from build_fmu import fingerprint
from coupling.errors import SimulationError
from coupling.fmu_worker import Job
from coupling.path import JointPath, ToolPath, WrenchHistory

Progress = Callable[[int, int], None]
# PythonFMU's binary crashes on other characters in the path of the unpacked FMU.
_SAFE_PATH = re.compile(r"[A-Za-z0-9_./\\:~ -]*")


class RobotFmu:
    """A robot FMU, unpacked and loaded for simulations; a context manager that cleans up.

    Args:
        file: The FMU.
        torque_curve: "linear", "backlash" or "spline".
        mode: "dynamic" or "quasistatic".
        progress: Called with steps done and steps in all, while a simulation runs.

    Raises:
        SimulationError: If the file is no robot FMU or cannot run here.
    """

    def __init__(
        self,
        file: Path,
        torque_curve: str = "backlash",
        mode: str = "quasistatic",
        progress: Progress | None = None,
    ) -> None:
        self.torque_curve = torque_curve
        self.mode = mode
        self._file = file
        self._progress = progress or (lambda done, total: None)
        self._folder = tempfile.TemporaryDirectory(prefix="elastic_robot_")
        if not _SAFE_PATH.fullmatch(self._folder.name):
            raise SimulationError(
                f"the folder for temporary files is {self._folder.name!r}; needed is a path of plain"
                " letters, digits and -_. (set TMPDIR), because the FMU's binary cannot take others"
            )
        try:
            fmpy.extract(str(file), unzipdir=self._folder.name)
        except Exception as cause:  # fmpy raises bare Exception for every kind of broken file
            raise SimulationError(f"{file}: is not a readable FMU: {cause}") from cause
        self.fingerprint = fingerprint(Path(self._folder.name, "resources"))
        one_thread = {"OPENBLAS_NUM_THREADS": "1", "OMP_NUM_THREADS": "1", "MKL_NUM_THREADS": "1"}
        self._said = tempfile.TemporaryFile()  # noqa: SIM115  (closed by close)
        self._process = subprocess.Popen(
            [sys.executable, "-m", "coupling.fmu_worker", self._folder.name],
            stdin=subprocess.PIPE,
            stdout=subprocess.PIPE,
            stderr=self._said,
            env={**os.environ, **one_thread},
        )
        kind, *text = self._answer()
        if kind != "ready":
            self.close()
            raise SimulationError(f"{file}: {text[0]}")

    def __enter__(self) -> RobotFmu:
        return self

    def __exit__(
        self,
        kind: type[BaseException] | None,
        error: BaseException | None,
        trace: TracebackType | None,
    ) -> None:
        self.close()

    def close(self) -> None:
        """End the process and remove the unpacked files."""
        self._process.kill()
        self._process.communicate()
        self._said.close()
        self._folder.cleanup()

    def simulate(self, command: JointPath, wrench: WrenchHistory) -> ToolPath:
        """Run a command under a wrench history and return the path that the TCP takes.

        Row k of the history acts over the step that ends at time[k], row 0 in initialisation.

        Args:
            command: Drive angles.
            wrench: On the tool, at the command's times.

        Raises:
            SimulationError: If the FMU refuses a step, with its reason.
        """
        if not np.array_equal(command.time, wrench.time):
            raise SimulationError("command and wrench are given at different times")
        settings = {"torque_curve": self.torque_curve, "mode": self.mode}
        job = Job(settings, command.time, command.q, wrench.wrench)
        assert self._process.stdin is not None
        try:
            pickle.dump(job, self._process.stdin)
            self._process.stdin.flush()
        except OSError as cause:
            raise self._death() from cause
        while True:
            kind, *content = self._answer()
            if kind == "path":
                return ToolPath(command.time, content[0])
            if kind == "error":
                raise SimulationError(content[0])
            self._progress(*content)

    def _answer(self) -> tuple[Any, ...]:
        assert self._process.stdout is not None
        try:
            answer: tuple[Any, ...] = pickle.load(self._process.stdout)
        except EOFError as cause:
            raise self._death() from cause
        return answer

    def _death(self) -> SimulationError:
        self._said.seek(0)
        lines = self._said.read().decode(errors="replace").strip().splitlines()
        last = f": {lines[-1]}" if lines else ""
        return SimulationError(f"{self._file}: the process that runs the FMU has ended{last}")
