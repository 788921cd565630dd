"""The robot as an FMU: simulations in a process of their own, as plain function calls."""

from __future__ import annotations

import os
import re
import tempfile
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from types import TracebackType

import numpy as np

from coupling.errors import SimulationError
from coupling.events import Progress, Watch, unwatched
from coupling.fmu.fmu_worker import Job
from coupling.fmu.worker import WorkerError, WorkerProcess, unpack
from coupling.path.histories import JointPath, ToolPath, WrenchHistory
from coupling.robot.robot import Mode
from elastic_robot.fingerprint import fingerprint

# PythonFMU's binary crashes on other characters in the path of the unpacked FMU.
_SAFE_PATH = re.compile(r"[A-Za-z0-9_./\\:~ -]*")


# A path shorter than this many steps is not worth a second process.
_WORTH_SHARING = 1000


class RobotFmu:
    """A robot FMU, unpacked and loaded for simulations; a context manager that cleans up.

    A quasi-static robot has no memory, so a long path is shared between two instances of the FMU
    that run side by side.

    Args:
        file: The FMU.
        torque_curve: "linear", "backlash" or "spline".
        watch: Function that is told how far a simulation is.

    Raises:
        SimulationError: If the file is no robot FMU or cannot run here.
    """

    def __init__(
        self,
        file: Path,
        torque_curve: str = "backlash",
        watch: Watch = unwatched,
    ) -> None:
        self.torque_curve = torque_curve
        self._file = file
        self._watch = watch
        self._folder = tempfile.TemporaryDirectory(prefix="elastic_robot_")
        if not _SAFE_PATH.fullmatch(self._folder.name):
            raise SimulationError(
                f"the folder for temporary files is {self._folder.name!r}; needed is a path of plain"
                " letters, digits and -_. (set TMPDIR), because the FMU's binary cannot take others"
            )
        with _simulation_errors(f"{file}: "):
            unpack(file, Path(self._folder.name))
        self.fingerprint = fingerprint(Path(self._folder.name, "resources"))
        self._processes = [self._start()]

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

    def simulate(self, command: JointPath, wrench: WrenchHistory, mode: Mode) -> ToolPath:
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
        columns = ["time", *(f"q{i + 1}" for i in range(command.q[0].shape[1]))]
        np.savez(trajectory, columns=columns, data=np.column_stack([command.time, command.q[0]]))
        settings = {
            "trajectory": str(trajectory),
            "torque_curve": self.torque_curve,
            "mode": mode,
        }
        parts = self._parts(len(command.time), mode)
        for process, rows in zip(self._processes, parts, strict=False):
            with _simulation_errors():
                process.send(Job(settings, wrench.time[rows], wrench.wrench[0, rows]))

        def progress(done: int, total: int) -> None:
            what = f"simulating the {mode} robot"
            self._watch(Progress(what, len(parts) * done, len(parts) * total))

        # Every answer is taken, so that no old one is in the way after an error.
        poses: list[np.ndarray] = []
        errors: list[SimulationError] = []
        for process, _ in zip(self._processes, parts, strict=False):
            try:
                with _simulation_errors():
                    poses.append(process.receive(progress))
            except SimulationError as error:
                errors.append(error)
        if errors:
            raise errors[0]
        return ToolPath(command.time, np.vstack(poses))

    def _parts(self, samples: int, mode: Mode) -> list[slice]:
        """Return the samples for each process."""
        if mode == "dynamic" or samples < _WORTH_SHARING or (os.cpu_count() or 1) < 2:
            return [slice(0, samples)]
        if len(self._processes) < 2:
            self._processes.append(self._start())
        return [slice(0, samples // 2), slice(samples // 2, samples)]

    def _start(self) -> WorkerProcess:
        with _simulation_errors(f"{self._file}: "):
            return WorkerProcess("coupling.fmu.fmu_worker", Path(self._folder.name))


@contextmanager
def _simulation_errors(where: str = "") -> Iterator[None]:
    """Turn a worker's errors into those of a simulation."""
    try:
        yield
    except WorkerError as cause:
        raise SimulationError(f"{where}{cause}") from cause
