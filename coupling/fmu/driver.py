"""Runs an FMU of FMI 2 or 3: the only place that drives FMPy.

An FMU in Python belongs into a process of its own (`coupling.fmu.worker`), because only in one that has
not imported the model the FMU's own modules answer, and because PythonFMU's binary, where it stands
alone, corrupts the heap when it is unloaded or the process ends in the ordinary way.
"""

from __future__ import annotations

import ctypes
import threading
from abc import ABC, abstractmethod
from collections.abc import Iterable, Iterator, Sequence
from contextlib import contextmanager
from itertools import chain
from pathlib import Path
from time import monotonic
from typing import Any, ClassVar
from weakref import WeakValueDictionary

import fmpy
import numpy as np
from fmpy.fmi1 import printLogMessage
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
from coupling.fmu.row_by_row import WARNING, StepFunctions, Stepper

# Between two reports of progress [s].
_REPORT_EVERY = 0.1
_REALS = ("Real", "Float64")


class Driver(ABC):
    """An unpacked FMU, its library loaded once.

    Args:
        folder: Folder with the unpacked FMU.
        description: Its model description.
        library: The desk library.

    Attributes:
        variables: Names of its variables.
        slave_type: FMPy's class.
        slave: FMPy's FMU.
        functions: Functions by which its version of FMI steps it.
    """

    slave_type: ClassVar[type]
    functions: ClassVar[StepFunctions]

    def __init__(self, folder: Path, description: ModelDescription, library: ctypes.CDLL) -> None:
        self._description, self._library = description, library
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
        caller, _thread.driver = _thread.driver, self
        try:
            yield
        except Exception as cause:  # FMPy raises bare Exception for most refusals
            *_, last = "", *"\n".join(self._errors).splitlines()
            raise FmuError(last or f"{type(cause).__name__}: {cause}") from cause
        finally:
            _thread.driver = caller

    def _simulate(self, job: SimulationJob, progress: Progress) -> np.ndarray:
        rows = np.array(job.rows, dtype=float, order="C")
        time, answers = np.array(job.time, dtype=float), np.empty((len(rows), job.width))
        steps = self.stepper(job.inputs, job.outputs, (rows.shape[1], job.width))
        self.enter_initialization(job)
        steps.set_inputs(rows[0])
        self.slave.exitInitializationMode()
        answers[0] = steps.read()
        first, count, last = 0, 1, len(rows) - 1
        while first < last:
            began, end = monotonic(), min(first + count, last)
            steps.advance(
                time[first : end + 1], rows[first + 1 : end + 1], answers[first + 1 : end + 1]
            )
            # As many steps at a time as take about as long as it shall be between two reports.
            is_fast = monotonic() - began < 0.5 * _REPORT_EVERY
            count = 2 * count if is_fast else max(count // 2, 1)
            first = end
            progress(first, last)
        self.slave.terminate()
        return answers

    def stepper(
        self, inputs: Sequence[str], outputs: Sequence[str], widths: tuple[int, int]
    ) -> Stepper:
        """Return what steps its instance, by names of real variables and numbers of their values."""
        inputs_at, outputs_at = (
            [self._references[name] for name in names] for names in (inputs, outputs)
        )
        return Stepper(self.functions, self.slave, self._library, inputs_at, outputs_at, widths)

    def _set_parameters(self, job: SimulationJob) -> None:
        apply_start_values(self.slave, self._description, dict(job.parameters))

    def log(self, *message: Any) -> None:
        """Keep the text of a message of the FMU if it is an error."""
        # FMI 2: environment, instance, status, category, text; FMI 3: without the instance.
        if message[-3] > WARNING:
            self._errors.append(message[-1].decode(errors="replace").strip())


class _Thread(threading.local):
    """The driver that calls its FMU in a thread."""

    driver: Driver | None = None


_thread = _Thread()
# Drivers that have an instance of FMI 2.0, by the environment that its messages name.
_drivers: WeakValueDictionary[int, _Fmi2] = WeakValueDictionary()


def _log_by_environment(environment: int | None, *message: Any) -> None:
    # Some FMUs do not say whose message it is.
    driver = _drivers.get(environment or 0) or _thread.driver
    if driver is None:
        printLogMessage(environment, *message)
    else:
        driver.log(*message)


# FMPy's proxy calls the logger that it was given last for all instances of the process, so it must
# outlive every driver and hand the messages of other instances on.
_LOGGER = fmi2CallbackLoggerTYPE(_log_by_environment)


class _Fmi2(Driver):
    slave_type = FMU2Slave
    functions = StepFunctions("2", ("fmi2SetReal", "fmi2DoStep", "fmi2GetReal"), counted=False)

    def instantiate(self) -> None:
        callbacks = fmi2CallbackFunctions(
            logger=_LOGGER,
            allocateMemory=fmi2CallbackAllocateMemoryTYPE(calloc),
            freeMemory=fmi2CallbackFreeMemoryTYPE(free),
            componentEnvironment=id(self),
        )
        _drivers[id(self)] = self
        addLoggerProxy(ctypes.byref(callbacks))
        self.slave.instantiate(callbacks=callbacks, loggingOn=True)

    def enter_initialization(self, job: SimulationJob) -> None:
        self.slave.setupExperiment(startTime=job.time[0], stopTime=job.time[-1])
        self._set_parameters(job)
        self.slave.enterInitializationMode()

    def free(self) -> None:
        self.slave.fmi2FreeInstance(self.slave.component)
        _drivers.pop(id(self), None)


class _Fmi3(Driver):
    slave_type = FMU3Slave
    functions = StepFunctions("3", ("fmi3SetFloat64", "fmi3DoStep", "fmi3GetFloat64"), counted=True)

    def instantiate(self) -> None:
        self.slave.instantiate(loggingOn=True, logMessage=self.log)

    def enter_initialization(self, job: SimulationJob) -> None:
        self._set_parameters(job)
        self.slave.enterInitializationMode(startTime=job.time[0], stopTime=job.time[-1])

    def free(self) -> None:
        self.slave.fmi3FreeInstance(self.slave.component)


_DRIVERS: dict[str, type[Driver]] = {driver.functions.version: driver for driver in (_Fmi2, _Fmi3)}


def _require_plain_name(identifier: str) -> None:
    """Refuse a modelIdentifier that leads out of the FMU: FMPy makes the library's path of it."""
    if not identifier.isidentifier():
        raise FmuError(f"expected a modelIdentifier of letters, digits and _, got {identifier!r}")


def load(folder: Path, library: ctypes.CDLL) -> Driver:
    """Return the driver of the unpacked FMU in a folder.

    Args:
        library: The desk library, which takes its steps.

    Raises:
        FmuError: If it is no FMU for co-simulation by FMI 2 or 3 that runs here.
    """
    try:
        description = fmpy.read_model_description(str(folder), validate=False)
        driver = _DRIVERS.get(description.fmiVersion[0])
        if description.coSimulation is not None and driver is not None:
            return driver(folder, description, library)
    except FmuError:
        raise
    except Exception as cause:  # whatever FMPy finds wrong with the file
        raise FmuError(f"is not an FMU that runs here: {cause}") from cause
    raise FmuError(
        f"expected an FMU of FMI 2 or 3 for co-simulation, got FMI {description.fmiVersion}"
        f"{'' if description.coSimulation else ' without co-simulation'}"
    )
