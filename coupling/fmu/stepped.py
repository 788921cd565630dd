"""FMUs that are advanced step by step, and taken back to where they were."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from math import inf
from pathlib import Path
from types import MappingProxyType
from typing import Any

import numpy as np

from coupling.files.scratch import ScratchFolder
from coupling.fmu.driver import Driver, load
from coupling.fmu.job import FmuError, MarchJob, SimulationJob, StepWindow
from coupling.fmu.worker import unpack
from coupling.native.desk_library import loaded_library


class SteppedInstance:
    """An instance of a loaded FMU between reals.

    Args:
        driver: The FMU.
        job: Parameters, inputs with their row of initialisation, outputs, and start and end.

    Attributes:
        time: End of the last step, or the start [s].

    Raises:
        FmuError: If the FMU refuses a name or a value.
    """

    def __init__(self, driver: Driver, job: SimulationJob) -> None:
        self.time = float(job.time[0])
        self._driver = driver
        self._kept: tuple[Any, float] | None = None
        row, self._width = np.array(job.rows[0], dtype=float), job.width
        self._is_there = False
        driver.require(job.inputs, job.outputs, parameters=job.parameters)
        try:
            with driver.explained():
                driver.instantiate()
                self._is_there = True
                self._steps = driver.stepper(job.inputs, job.outputs, (len(row), job.width))
                driver.enter_initialization(job)
                self._steps.set_inputs(row)
                driver.slave.exitInitializationMode()
        except BaseException:
            self.close()
            raise

    def close(self) -> None:
        """Free the instance and its kept state."""
        if self._is_there:
            self._forget()
            self._driver.free()
            self._is_there = False

    def read(self) -> np.ndarray:
        """Return the outputs, any unit, (outputs,).

        Raises:
            FmuError: If the FMU refuses.
        """
        with self._driver.explained():
            return self._steps.read()

    def step(self, inputs: np.ndarray, size: float) -> np.ndarray:
        """Move on by a step and return the outputs, any unit, (outputs,).

        Args:
            inputs: Values at the step's start, any unit, (inputs,).
            size: Length of the step [s].

        Raises:
            FmuError: If the FMU refuses.
        """
        time = np.array([self.time, self.time + size])
        return self._advance(time, np.array(inputs, dtype=float)[None])[0]

    def run(self, window: StepWindow) -> np.ndarray:
        """Move on by the steps of a window and return the outputs at their ends, any unit, (n, outputs).

        Raises:
            FmuError: If the FMU refuses.
        """
        if window.is_repeat:
            self.go_back()
        else:
            self.keep()
        return self._advance(window.time, window.rows)

    def _advance(self, time: np.ndarray, rows: np.ndarray) -> np.ndarray:
        answers = np.empty((len(rows), self._width))
        with self._driver.explained():
            times, values = (np.ascontiguousarray(array, dtype=float) for array in (time, rows))
            self._steps.advance(times, values, answers)
        self.time = float(time[-1])
        return answers

    def keep(self) -> None:
        """Keep the present state; the one kept before is freed."""
        self._forget()
        with self._driver.explained():
            self._kept = (self._driver.slave.getFMUState(), self.time)

    def go_back(self) -> None:
        """Go back to the kept state."""
        assert self._kept is not None
        state, time = self._kept
        with self._driver.explained():
            self._driver.slave.setFMUState(state)
        self.time = time

    def _forget(self) -> None:
        if self._kept is not None:
            self._driver.slave.freeFMUState(self._kept[0])
            self._kept = None


class SteppedFmu(SteppedInstance):
    """An instance of an FMU of FMI 2 or 3 in this process; a context manager that frees it.

    Args:
        file: The FMU, a native one: that in Python belongs into a process without the model.
        inputs, outputs: Names of scalar variables; inputs are 0 in initialisation.
        parameters: Start values by name.
        start: Start time [s].

    Raises:
        FmuError: If the file is no FMU that runs here, or refuses a name or a value.
        CompilerError: If the desk library is neither shipped nor can be compiled here.
    """

    def __init__(
        self,
        file: Path,
        inputs: Sequence[str],
        outputs: Sequence[str],
        parameters: Mapping[str, float | str] = MappingProxyType({}),
        start: float = 0.0,
    ) -> None:
        self._folder = ScratchFolder()
        try:
            unpack(file, self._folder.path)
            if (self._folder.path / "resources" / "slavemodule.txt").is_file():
                raise FmuError(
                    "expected an FMU without Python, got one in Python: build a native one"
                )
            rows, time = np.zeros((1, len(inputs))), np.array([start, inf])
            names = tuple(inputs), tuple(outputs)
            job = MarchJob(parameters, time, names[0], rows, names[1], len(outputs))
            super().__init__(load(self._folder.path, loaded_library()), job)
        except BaseException:
            self._folder.close()
            raise

    def __enter__(self) -> SteppedFmu:
        return self

    def __exit__(self, *error: object) -> None:
        self.close()

    def close(self) -> None:
        """Free the instance and its kept state, and remove the unpacked files."""
        super().close()
        self._folder.close()
