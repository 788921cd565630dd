"""What runs a robot FMU in a `coupling.worker`; the only place that drives FMPy for the robot.

In a process of its own, because PythonFMU's binary corrupts the heap when it is unloaded or the
process ends in the ordinary way, and because only in a process that has not imported the model the
FMU's own modules answer.
"""

from __future__ import annotations

import ctypes
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from pathlib import Path

import fmpy
import numpy as np
from fmpy.fmi1 import FMICallException
from fmpy.fmi2 import FMU2Slave

from coupling.tables import POSE_COLUMNS
from coupling.worker import Progress, WorkerError

WRENCH = ("force.x", "force.y", "force.z", "moment.x", "moment.y", "moment.z")
# Steps between two reports of progress.
_REPORT_EVERY = 100


@dataclass(frozen=True)
class Job:
    """One simulation.

    Attributes:
        settings: String parameters of the FMU.
        time: Communication points [s], (n,).
        wrench: Over the step that ends there [N, N m], (n, 6).
    """

    settings: dict[str, str]
    time: np.ndarray
    wrench: np.ndarray


class _Buffer:
    """Several reals set or read in one call, without FMPy's list conversions."""

    def __init__(self, references: Sequence[int]) -> None:
        self._count = len(references)
        self._references = (ctypes.c_uint32 * self._count)(*references)
        self._values = (ctypes.c_double * self._count)()
        self._array = np.ctypeslib.as_array(self._values)

    def set(self, fmu: FMU2Slave, values: np.ndarray) -> None:
        self._array[:] = values
        fmu.fmi2SetReal(fmu.component, self._references, self._count, self._values)

    def get(self, fmu: FMU2Slave, values: np.ndarray) -> None:
        fmu.fmi2GetReal(fmu.component, self._references, self._count, self._values)
        values[:] = self._array


class Worker:
    """An unpacked FMU, its library loaded once."""

    def __init__(self, folder: Path) -> None:
        description = fmpy.read_model_description(str(folder))
        if description.fmiVersion != "2.0":
            raise ValueError(f"it is of FMI {description.fmiVersion}; needed is one of FMI 2.0")
        self._references = {v.name: v.valueReference for v in description.modelVariables}
        self._fmu = FMU2Slave(
            guid=description.guid,
            unzipDirectory=str(folder),
            modelIdentifier=description.coSimulation.modelIdentifier,
            instanceName="robot",
        )

    def run(self, job: Job, progress: Progress) -> np.ndarray:
        """Return the TCP's poses, (n, 7)."""
        settings = job.settings
        load = _Buffer([self._references[name] for name in WRENCH])
        tcp = _Buffer([self._references[f"tcp.{name}"] for name in POSE_COLUMNS])
        time, last = job.time, len(job.time) - 1
        poses = np.empty((last + 1, len(POSE_COLUMNS)))
        fmu = self._fmu
        fmu.instantiate()
        try:
            fmu.setupExperiment(startTime=time[0])
            fmu.setString([self._references[name] for name in settings], settings.values())
            fmu.enterInitializationMode()
            load.set(fmu, job.wrench[0])
            fmu.exitInitializationMode()
            tcp.get(fmu, poses[0])
            for k in range(1, last + 1):
                load.set(fmu, job.wrench[k])
                fmu.doStep(time[k - 1], time[k] - time[k - 1])
                tcp.get(fmu, poses[k])
                if k % _REPORT_EVERY == 0 or k == last:
                    progress(k, last)
            fmu.terminate()
        finally:
            # Not FMPy's freeInstance, which unloads the library.
            fmu.fmi2FreeInstance(fmu.component)
        return poses


def load(folder: Path) -> Callable[[Job, Progress], np.ndarray]:
    """Return what runs jobs on the unpacked FMU in a folder.

    Raises:
        WorkerError: If it is no robot FMU.
    """
    try:
        worker = Worker(folder)
    except Exception as cause:  # whatever FMPy finds wrong with the file
        raise WorkerError(f"is not a robot FMU that runs here: {cause}") from cause

    def run(job: Job, progress: Progress) -> np.ndarray:
        try:
            return worker.run(job, progress)
        except (FMICallException, KeyError) as cause:
            raise WorkerError(f"{type(cause).__name__}: {cause}") from cause

    return run
