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

from coupling.errors import SimulationError
from coupling.fmu_worker import Job
from coupling.path import JointPath, ToolPath, WrenchHistory
from elastic_robot.fingerprint import fingerprint

Progress = Callable[[int, int], None]
# PythonFMU's binary crashes on other characters in the path of the unpacked FMU.
_SAFE_PATH = re.compile(r"[A-Za-z0-9_./\\:~ -]*")


# A path shorter than this many steps is not worth a second process.
_WORTH_SHARING = 1000


class _Process:
    """A running `coupling.fmu_worker`."""

    def __init__(self, file: Path, folder: Path) -> None:
        self._file = file
        one_thread = {"OPENBLAS_NUM_THREADS": "1", "OMP_NUM_THREADS": "1", "MKL_NUM_THREADS": "1"}
        self._said = tempfile.TemporaryFile()  # noqa: SIM115  (closed by close)
        self._process = subprocess.Popen(
            [sys.executable, "-m", "coupling.fmu_worker", str(folder)],
            stdin=subprocess.PIPE,
            stdout=subprocess.PIPE,
            stderr=self._said,
            env={**os.environ, **one_thread},
        )
        kind, *text = self._answer()
        if kind != "ready":
            self.close()
            raise SimulationError(f"{file}: {text[0]}")

    def close(self) -> None:
        self._process.kill()
        self._process.communicate()
        self._said.close()

    def send(self, job: Job) -> None:
        assert self._process.stdin is not None
        try:
            pickle.dump(job, self._process.stdin)
            self._process.stdin.flush()
        except OSError as cause:
            raise self._death() from cause

    def receive(self, progress: Progress) -> np.ndarray:
        """Return the poses of the job sent last, (n, 7)."""
        while True:
            kind, *content = self._answer()
            if kind == "path":
                poses: np.ndarray = content[0]
                return poses
            if kind == "error":
                raise SimulationError(content[0])
            progress(*content)

    def _answer(self) -> tuple[Any, ...]:
        assert self._process.stdout is not None
        try:
            answer: tuple[Any, ...] = pickle.load(self._process.stdout)
        except (EOFError, pickle.UnpicklingError) as cause:
            raise self._death() from cause
        return answer

    def _death(self) -> SimulationError:
        self._said.seek(0)
        lines = self._said.read().decode(errors="replace").strip().splitlines()
        last = f": {lines[-1]}" if lines else ""
        return SimulationError(f"{self._file}: the process that runs the FMU has ended{last}")


class RobotFmu:
    """A robot FMU, unpacked and loaded for simulations; a context manager that cleans up.

    A quasi-static robot has no memory, so a long path is shared between two instances of the FMU
    that run side by side.

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
        self._processes = [_Process(file, Path(self._folder.name))]

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
        """End the processes and remove the unpacked files."""
        for process in self._processes:
            process.close()
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
        trajectory = Path(self._folder.name, "trajectory.npz")
        columns = ["time", *(f"q{i + 1}" for i in range(command.q.shape[1]))]
        np.savez(trajectory, columns=columns, data=np.column_stack([command.time, command.q]))
        settings = {
            "trajectory": str(trajectory),
            "torque_curve": self.torque_curve,
            "mode": self.mode,
        }
        parts = self._parts(len(command.time))
        for process, rows in zip(self._processes, parts, strict=False):
            process.send(Job(settings, wrench.time[rows], wrench.wrench[rows]))

        def progress(done: int, total: int) -> None:
            self._progress(len(parts) * done, len(parts) * total)

        # Every answer is taken, so that no old one is in the way after an error.
        poses: list[np.ndarray] = []
        errors: list[SimulationError] = []
        for process, _ in zip(self._processes, parts, strict=False):
            try:
                poses.append(process.receive(progress))
            except SimulationError as error:
                errors.append(error)
        if errors:
            raise errors[0]
        return ToolPath(command.time, np.vstack(poses))

    def _parts(self, samples: int) -> list[slice]:
        """Return the samples for each process."""
        if self.mode == "dynamic" or samples < _WORTH_SHARING or (os.cpu_count() or 1) < 2:
            return [slice(0, samples)]
        if len(self._processes) < 2:
            self._processes.append(_Process(self._file, Path(self._folder.name)))
        return [slice(0, samples // 2), slice(samples // 2, samples)]
