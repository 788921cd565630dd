"""What is asked of an FMU in a process of its own; no FMPy, which takes as long to import as NumPy."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass

import numpy as np

from coupling.errors import CouplingError

Progress = Callable[[int, int], None]


class FmuError(CouplingError):
    """An FMU cannot be loaded or refuses a job, with its reason, or its process has ended."""


@dataclass(frozen=True)
class SimulationJob:
    """One simulation of an FMU between sampled inputs and outputs.

    Attributes:
        parameters: Start values by name.
        time: Communication points [s], (n,).
        inputs: Names of real variables; an array counts as all its elements.
        rows: Values of the inputs; row k is held over the step that ends at time[k], row 0 in
            initialisation, (n, k).
        outputs: Names of real variables.
        width: Number of values of the outputs.
    """

    parameters: Mapping[str, float | int | bool | str]
    time: np.ndarray
    inputs: tuple[str, ...]
    rows: np.ndarray
    outputs: tuple[str, ...]
    width: int


@dataclass(frozen=True)
class MarchJob(SimulationJob):
    """A simulation whose steps are not known when it begins: windows follow (`StepWindow`).

    Its times are start and end, its row of inputs is that of initialisation; the answer is one row of
    outputs, those at the start.
    """


@dataclass(frozen=True)
class StepWindow:
    """Some steps of a `MarchJob`, from the end of those before, or once more from their start.

    Attributes:
        time: Communication points, start and end included [s], (n + 1,).
        rows: Inputs over each step, any unit, (n, k).
        is_repeat: Whether the steps of the window before are taken back.
    """

    time: np.ndarray
    rows: np.ndarray
    is_repeat: bool
