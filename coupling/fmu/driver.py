"""Runs an FMU of FMI 2 or 3: the only place that drives FMPy.

An FMU in Python belongs into a process of its own (`coupling.fmu.worker`), because only in one that has
not imported the model the FMU's own modules answer, and because PythonFMU's binary, where it stands
alone, corrupts the heap when it is unloaded or the process ends in the ordinary way.
"""

from __future__ import annotations

import ctypes
from abc import ABC, abstractmethod
from collections.abc import Callable, Iterable, Iterator, Sequence
from contextlib import contextmanager
from itertools import chain
from pathlib import Path
from time import monotonic
from typing import Any, ClassVar

import fmpy
import numpy as np
from fmpy.fmi1 import FMICallException
from fmpy.fmi2 import (
    FMU2Slave,
    calloc,
    fmi2CallbackAllocateMemoryTYPE,
    fmi2CallbackFreeMemoryTYPE,
    fmi2CallbackFunctions,
    fmi2CallbackLoggerTYPE,
    free,
)
from fmpy.fmi3 import FMU3Slave
from fmpy.logging import addLoggerProxy
from fmpy.model_description import ModelDescription
from fmpy.simulation import apply_start_values

from coupling.fmu.job import FmuError, Progress, SimulationJob

# Status of FMI 2 and 3: the highest of a call that did what it was asked, and of a log message that
# reports no refusal.
_WARNING = 1
# Between two reports of progress [s], and steps after which the time is looked at.
_REPORT_EVERY = 0.1
_LOOK_EVERY = 100


_REALS = ("Real", "Float64")


class Series:
    """Rows of reals, each set or read in place by one call.

    FMPy's own calls make lists of every row, which costs more than a step of a fast FMU.

    Args:
        slave: Has an instance.
        function: Name of the standard's function that sets or gets reals.
        references: Value references of the columns' variables.
        rows: Values in C order, which can be written, (n, k).
        counted: Whether the function takes the number of values as well.
    """

    def __init__(
        self,
        slave: FMU2Slave | FMU3Slave,
        function: str,
        references: Sequence[int],
        rows: np.ndarray,
        counted: bool,
    ) -> None:
        self._name, self._call = function, slave.dll[function]
        self._component, count = ctypes.c_void_p(slave.component), ctypes.c_size_t(rows.shape[1])
        self._references = (ctypes.c_uint32 * len(references))(*references)
        self._count = ctypes.c_size_t(len(references))
        self._counted = (count,) if counted else ()
        self._rows = (ctypes.c_double * rows.shape[1] * len(rows)).from_buffer(rows)

    def move(self, k: int) -> None:
        """Move row `k` to the FMU, or from it."""
        status = self._call(
            self._component, self._references, self._count, self._rows[k], *self._counted
        )
        if status > _WARNING:
            raise FMICallException(function=self._name, status=status)


class Driver(ABC):
    """An unpacked FMU, its library loaded once.

    Args:
        folder: Folder with the unpacked FMU.
        description: Its model description.

    Attributes:
        variables: Names of its variables.
        version: Version of FMI, "2" or "3".
        slave_type: FMPy's class.
        slave: FMPy's FMU.
        setter, getter: Names of the standard's functions that set and get reals.
        counted: Whether these take the number of values as well.
    """

    version: ClassVar[str]
    slave_type: ClassVar[type]
    setter: ClassVar[str]
    getter: ClassVar[str]
    counted: ClassVar[bool]

    def __init__(self, folder: Path, description: ModelDescription) -> None:
        self._description = description
        _require_plain_name(description.coSimulation.modelIdentifier)
        # References of FMI 2 count per type: that of a Real says nothing of an Integer.
        self._references = {
            v.name: v.valueReference for v in description.modelVariables if v.type in _REALS
        }
        self.variables = frozenset(v.name for v in description.modelVariables)
        self.slave = self.slave_type(
            guid=description.guid,
            unzipDirectory=str(folder),
            modelIdentifier=description.coSimulation.modelIdentifier,
        )
        self._errors: list[str] = []

    @abstractmethod
    def instantiate(self) -> None:
        """Make an instance that logs."""

    @abstractmethod
    def enter_initialization(self, job: SimulationJob) -> None:
        """Set times and parameters and enter initialisation mode."""

    @abstractmethod
    def free(self) -> None:
        """Free the instance; not by FMPy's freeInstance, which unloads the library."""

    def run(self, job: SimulationJob, progress: Progress) -> np.ndarray:
        """Return the outputs at the communication points, any unit, (n, job.width).

        Raises:
            FmuError: If the FMU does not know a name or refuses a call.
        """
        self.require(job.inputs, job.outputs, parameters=job.parameters)
        with self.explained():
            self.instantiate()
            try:
                return self._simulate(job, progress)
            finally:
                self.free()

    def require(self, *reals: Iterable[str], parameters: Iterable[str] = ()) -> None:
        """Raise an FmuError unless all names are those of real variables, or of any for parameters."""
        for names, available in (
            ({*chain(*reals)}, frozenset(self._references)),
            ({*parameters}, self.variables),
        ):
            if unknown := names - available:
                raise FmuError(
                    f"expected variables out of {', '.join(sorted(available))}, got"
                    f" {', '.join(sorted(unknown))}"
                )

    @contextmanager
    def explained(self) -> Iterator[None]:
        """Have refused calls raise an FmuError with what the FMU has logged."""
        self._errors.clear()
        try:
            yield
        except Exception as cause:  # FMPy raises bare Exception for most refusals
            *_, last = "", *"\n".join(self._errors).splitlines()
            raise FmuError(last or f"{type(cause).__name__}: {cause}") from cause

    def _simulate(self, job: SimulationJob, progress: Progress) -> np.ndarray:
        time, last, slave = job.time.tolist(), len(job.time) - 1, self.slave
        answers = np.empty((last + 1, job.width))
        inputs = self.series(self.setter, job.inputs, np.array(job.rows, dtype=float, order="C"))
        outputs = self.series(self.getter, job.outputs, answers)
        step = self.stepper()
        self.enter_initialization(job)
        inputs.move(0)
        slave.exitInitializationMode()
        outputs.move(0)
        said = monotonic()
        for k in range(1, last + 1):
            inputs.move(k)
            step(time[k - 1], time[k] - time[k - 1])
            outputs.move(k)
            if k % _LOOK_EVERY == 0 and monotonic() - said > _REPORT_EVERY:
                said = monotonic()
                progress(k, last)
        progress(last, last)
        slave.terminate()
        return answers

    def stepper(self) -> Callable[[float, float], Any]:
        """Return the function that steps from a time [s] by a size [s], or raises FMPy's errors."""
        return self.slave.doStep

    def series(self, function: str, names: Sequence[str], rows: np.ndarray) -> Series:
        """Return what sets or gets named reals, row by row, while the instance is there.

        Args:
            function: `setter` or `getter`.
            names: Variables of the columns.
            rows: Values, any unit, in C order, (n, k).
        """
        references = [self._references[name] for name in names]
        return Series(self.slave, function, references, rows, self.counted)

    def _set_parameters(self, job: SimulationJob) -> None:
        apply_start_values(self.slave, self._description, dict(job.parameters))

    def _log(self, *message: Any) -> None:
        # FMI 2: environment, instance, status, category, text; FMI 3: without the instance.
        if message[-3] > _WARNING:
            self._errors.append(message[-1].decode(errors="replace").strip())


class _Fmi2(Driver):
    version, slave_type = "2", FMU2Slave
    setter, getter, counted = "fmi2SetReal", "fmi2GetReal", False

    def instantiate(self) -> None:
        callbacks = fmi2CallbackFunctions(
            logger=fmi2CallbackLoggerTYPE(self._log),
            allocateMemory=fmi2CallbackAllocateMemoryTYPE(calloc),
            freeMemory=fmi2CallbackFreeMemoryTYPE(free),
        )
        addLoggerProxy(ctypes.byref(callbacks))
        self.slave.instantiate(callbacks=callbacks, loggingOn=True)

    def enter_initialization(self, job: SimulationJob) -> None:
        self.slave.setupExperiment(startTime=job.time[0], stopTime=job.time[-1])
        self._set_parameters(job)
        self.slave.enterInitializationMode()

    def stepper(self) -> Callable[[float, float], Any]:
        # Past FMPy's layers, which cost as much as the call.
        types = [ctypes.c_int, ctypes.c_void_p, ctypes.c_double, ctypes.c_double, ctypes.c_int]
        call = ctypes.CFUNCTYPE(*types)(("fmi2DoStep", self.slave.dll))
        component = self.slave.component

        def step(start: float, size: float) -> None:
            status = call(component, start, size, 1)
            if status > _WARNING:
                raise FMICallException(function="fmi2DoStep", status=status)

        return step

    def free(self) -> None:
        self.slave.fmi2FreeInstance(self.slave.component)


class _Fmi3(Driver):
    version, slave_type = "3", FMU3Slave
    setter, getter, counted = "fmi3SetFloat64", "fmi3GetFloat64", True

    def instantiate(self) -> None:
        self.slave.instantiate(loggingOn=True, logMessage=self._log)

    def enter_initialization(self, job: SimulationJob) -> None:
        self._set_parameters(job)
        self.slave.enterInitializationMode(startTime=job.time[0], stopTime=job.time[-1])

    def stepper(self) -> Callable[[float, float], Any]:
        has_ended = False

        def step(start: float, size: float) -> None:
            nonlocal has_ended
            if not has_ended:
                _, has_ended, is_early, _ = self.slave.doStep(start, size)
                if not is_early:
                    return
            raise FmuError(f"has ended its simulation at {start:.6g} s, before the end of the path")

        return step

    def free(self) -> None:
        self.slave.fmi3FreeInstance(self.slave.component)


_DRIVERS: dict[str, type[Driver]] = {driver.version: driver for driver in (_Fmi2, _Fmi3)}


def _require_plain_name(identifier: str) -> None:
    """Refuse a modelIdentifier that leads out of the FMU: FMPy makes the library's path of it."""
    if not identifier.isidentifier():
        raise FmuError(f"expected a modelIdentifier of letters, digits and _, got {identifier!r}")


def load(folder: Path) -> Driver:
    """Return the driver of the unpacked FMU in a folder.

    Raises:
        FmuError: If it is no FMU for co-simulation by FMI 2 or 3 that runs here.
    """
    try:
        description = fmpy.read_model_description(str(folder), validate=False)
        driver = _DRIVERS.get(description.fmiVersion[0])
        if description.coSimulation is not None and driver is not None:
            return driver(folder, description)
    except FmuError:
        raise
    except Exception as cause:  # whatever FMPy finds wrong with the file
        raise FmuError(f"is not an FMU that runs here: {cause}") from cause
    raise FmuError(
        f"expected an FMU of FMI 2 or 3 for co-simulation, got FMI {description.fmiVersion}"
        f"{'' if description.coSimulation else ' without co-simulation'}"
    )
