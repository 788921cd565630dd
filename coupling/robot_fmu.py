"""The robot as an FMU: the only place that drives FMPy."""

from __future__ import annotations

import contextlib
import ctypes
import io
import re
import tempfile
from collections.abc import Callable, Sequence
from pathlib import Path
from types import TracebackType

import fmpy
import numpy as np
from fmpy.fmi1 import FMICallException
from fmpy.fmi2 import FMU2Slave

from build_fmu import fingerprint, package_folder
from coupling.errors import SimulationError
from coupling.path import JointPath, ToolPath, WrenchHistory
from coupling.tables import POSE_COLUMNS

Progress = Callable[[int, int], None]
# Steps between two reports of progress.
_REPORT_EVERY = 100
# PythonFMU's binary crashes on other characters in the path of the unpacked FMU.
_SAFE_PATH = re.compile(r"[A-Za-z0-9_./\\:~ -]*")


class RobotFmu:
    """A robot FMU, unpacked and ready for simulations; a context manager that cleans up.

    Args:
        file: The FMU.
        torque_curve: "linear", "backlash" or "spline".
        mode: "dynamic" or "quasistatic".
        progress: Called with steps done and steps in all, while a simulation runs.

    Raises:
        SimulationError: If the file is no robot FMU, or was built from another version of the
            model than the one imported here (the host's modules would answer instead of its own).
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
        self.simulations = 0
        self._progress = progress or (lambda done, total: None)
        self._folder = tempfile.TemporaryDirectory(prefix="elastic_robot_")
        if not _SAFE_PATH.fullmatch(self._folder.name):
            raise SimulationError(
                f"the folder for temporary files is {self._folder.name!r}; needed is a path of plain"
                " letters, digits and -_. (set TMPDIR), because the FMU's binary cannot take others"
            )
        try:
            self._description = fmpy.read_model_description(str(file))
            fmpy.extract(str(file), unzipdir=self._folder.name)
        except Exception as cause:  # fmpy raises bare Exception for every kind of broken file
            raise SimulationError(f"{file}: is not a readable FMU: {cause}") from cause
        resources = Path(self._folder.name, "resources")
        self.fingerprint = fingerprint(resources)
        if fingerprint(resources / "elastic_robot") != fingerprint(package_folder("elastic_robot")):
            raise SimulationError(
                f"{file}: was built from another version of the model than the installed one;"
                " build it anew"
            )
        self._references = {v.name: v.valueReference for v in self._description.modelVariables}

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
        """Remove the unpacked files."""
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
        instance = FMU2Slave(
            guid=self._description.guid,
            unzipDirectory=self._folder.name,
            modelIdentifier=self._description.coSimulation.modelIdentifier,
            instanceName="robot",
        )
        self.simulations += 1
        said = io.StringIO()  # the FMU tells the reason of an error on stderr only
        with contextlib.redirect_stderr(said):
            try:
                return self._run(instance, str(trajectory), command.time, wrench.wrench)
            except FMICallException as cause:
                reason = said.getvalue().strip().splitlines()
                raise SimulationError(reason[-1] if reason else str(cause)) from cause

    def _run(
        self, instance: FMU2Slave, trajectory: str, time: np.ndarray, wrench: np.ndarray
    ) -> ToolPath:
        instance.instantiate()
        try:
            instance.setupExperiment(startTime=time[0])
            settings = {
                "trajectory": trajectory,
                "torque_curve": self.torque_curve,
                "mode": self.mode,
            }
            instance.setString([self._references[name] for name in settings], settings.values())
            load = self._buffer(
                ["force.x", "force.y", "force.z", "moment.x", "moment.y", "moment.z"]
            )
            tcp = self._buffer([f"tcp.{name}" for name in POSE_COLUMNS])
            poses = np.empty((len(time), len(POSE_COLUMNS)))
            instance.enterInitializationMode()
            load.set(instance, wrench[0])
            instance.exitInitializationMode()
            tcp.get(instance, poses[0])
            for k in range(1, len(time)):
                load.set(instance, wrench[k])
                instance.doStep(time[k - 1], time[k] - time[k - 1])
                tcp.get(instance, poses[k])
                if k % _REPORT_EVERY == 0:
                    self._progress(k, len(time) - 1)
            self._progress(len(time) - 1, len(time) - 1)
            instance.terminate()
        finally:
            instance.freeInstance()
        return ToolPath(time, poses)

    def _buffer(self, names: Sequence[str]) -> _Buffer:
        return _Buffer([self._references[name] for name in names])


class _Buffer:
    """Several reals set or read in one call, without FMPy's list conversions."""

    def __init__(self, references: Sequence[int]) -> None:
        self._count = len(references)
        self._references = (ctypes.c_uint32 * self._count)(*references)
        self._values = (ctypes.c_double * self._count)()
        self._array = np.ctypeslib.as_array(self._values)

    def set(self, instance: FMU2Slave, values: np.ndarray) -> None:
        self._array[:] = values
        instance.fmi2SetReal(instance.component, self._references, self._count, self._values)

    def get(self, instance: FMU2Slave, values: np.ndarray) -> None:
        instance.fmi2GetReal(instance.component, self._references, self._count, self._values)
        values[:] = self._array
