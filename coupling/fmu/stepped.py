"""An FMU that is advanced step by step in this process, and taken back to where it was."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from math import inf
from pathlib import Path
from types import MappingProxyType
from typing import Any

import numpy as np

from coupling.files.scratch import ScratchFolder
from coupling.fmu.driver import load
from coupling.fmu.job import FmuError, SimulationJob
from coupling.fmu.worker import unpack


class SteppedFmu:
    """An instance of an FMU of FMI 2 or 3 between named reals; a context manager that frees it.

    Args:
        file: The FMU, a native one: that in Python belongs into a process without the model.
        inputs, outputs: Names of scalar variables.
        parameters: Start values by name.
        start: Start time [s].

    Attributes:
        time: End of the last step, or the start [s].

    Raises:
        FmuError: If the file is no FMU that runs here, or refuses a name or a value.
    """

    def __init__(
        self,
        file: Path,
        inputs: Sequence[str],
        outputs: Sequence[str],
        parameters: Mapping[str, float | str] = MappingProxyType({}),
        start: float = 0.0,
    ) -> None:
        self.time = start
        self._kept: tuple[Any, float] | None = None
        self._inputs, self._outputs = np.zeros((1, len(inputs))), np.zeros((1, len(outputs)))
        self._folder = ScratchFolder()
        self._is_there = False
        try:
            unpack(file, self._folder.path)
            if (self._folder.path / "resources" / "slavemodule.txt").is_file():
                raise FmuError(
                    "expected an FMU without Python, got one in Python: build a native one"
                )
            self._driver = load(self._folder.path)
            self._driver.require(inputs, outputs, parameters=parameters)
            job = SimulationJob(parameters, np.array([start, inf]), (), self._inputs, (), 0)
            with self._driver.explained():
                self._driver.instantiate()
                self._is_there = True
                self._step = self._driver.stepper()
                self._in = self._driver.series(self._driver.setter, inputs, self._inputs)
                self._out = self._driver.series(self._driver.getter, outputs, self._outputs)
                self._driver.enter_initialization(job)
                self._driver.slave.exitInitializationMode()
        except BaseException:
            self.close()
            raise

    def __enter__(self) -> SteppedFmu:
        return self

    def __exit__(self, *error: object) -> None:
        self.close()

    def close(self) -> None:
        """Free the instance and its kept state, and remove the unpacked files."""
        if self._is_there:
            self._forget()
            self._driver.free()
            self._is_there = False
        self._folder.close()

    def read(self) -> np.ndarray:
        """Return the outputs, any unit, (outputs,).

        Raises:
            FmuError: If the FMU refuses.
        """
        with self._driver.explained():
            self._out.move(0)
        return self._outputs[0].copy()

    def step(self, inputs: np.ndarray, size: float) -> np.ndarray:
        """Move on by a step and return the outputs, any unit, (outputs,).

        Args:
            inputs: Values at the step's start, any unit, (inputs,).
            size: Length of the step [s].

        Raises:
            FmuError: If the FMU refuses.
        """
        self._inputs[0] = inputs
        with self._driver.explained():
            self._in.move(0)
            self._step(self.time, size)
        self.time += size
        return self.read()

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
