"""What runs a robot FMU in a `coupling.fmu.worker`; the only place that drives FMPy for the robot.

In a process of its own, because only in one that has not imported the model the FMU's own modules
answer, and because PythonFMU's binary, where it stands alone, corrupts the heap when it is unloaded
or the process ends in the ordinary way.
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

from coupling.files.csv_table import POSE_COLUMNS
from coupling.fmu.worker import Progress, WorkerError

WRENCH = ("force.x", "force.y", "force.z", "moment.x", "moment.y", "moment.z")
# The highest status [FMI 2.0, 2.1.3] of a call that did what it was asked.
_WARNING = 1
_REALS = ctypes.CFUNCTYPE(
    ctypes.c_int, ctypes.c_void_p, ctypes.c_void_p, ctypes.c_size_t, ctypes.c_void_p
)
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


class _Series:
    """Rows of reals, each set or read in place by one call.

    FMPy's own calls make lists of every row, which costs more than a step of a fast FMU.

    Args:
        fmu: Has an instance.
        function: "fmi2SetReal" or "fmi2GetReal".
        references: Of the columns' variables.
        rows: In C order, (n, k).
    """

    def __init__(
        self, fmu: FMU2Slave, function: str, references: Sequence[int], rows: np.ndarray
    ) -> None:
        self._name, self._rows, self._component = function, rows, fmu.component
        self._call = _REALS((function, fmu.dll))
        self._references = (ctypes.c_uint32 * len(references))(*references)
        self._count = len(references)
        self._start, self._stride = rows.ctypes.data, rows.strides[0]

    def move(self, k: int) -> None:
        """Move row `k` to the FMU, or from it."""
        address = self._start + k * self._stride
        status = self._call(self._component, self._references, self._count, address)
        if status > _WARNING:
            raise FMICallException(function=self._name, status=status)


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
        time, last = job.time.tolist(), len(job.time) - 1
        poses = np.empty((last + 1, len(POSE_COLUMNS)))
        loads = np.ascontiguousarray(job.wrench, dtype=float)
        fmu = self._fmu
        fmu.instantiate()
        try:
            wrench = _Series(fmu, "fmi2SetReal", [self._references[n] for n in WRENCH], loads)
            names = [f"tcp.{column}" for column in POSE_COLUMNS]
            tcp = _Series(fmu, "fmi2GetReal", [self._references[n] for n in names], poses)
            fmu.setupExperiment(startTime=time[0])
            fmu.setString([self._references[name] for name in settings], settings.values())
            fmu.enterInitializationMode()
            wrench.move(0)
            fmu.exitInitializationMode()
            tcp.move(0)
            for k in range(1, last + 1):
                wrench.move(k)
                fmu.doStep(time[k - 1], time[k] - time[k - 1])
                tcp.move(k)
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
