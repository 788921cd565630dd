"""What runs a process FMU in a `coupling.fmu.worker`: FMI 2 or 3 co-simulation, values by name."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import fmpy
import numpy as np
from fmpy.fmi2 import FMU2Slave
from fmpy.fmi3 import FMU3Slave
from fmpy.simulation import apply_start_values, instantiate_fmu

from coupling.fmu.worker import Progress, WorkerError

# Steps between two reports of progress.
_REPORT_EVERY = 100
# Status of a log message of FMI 2 and 3 from which on it tells of an error.
_ERROR = 3


@dataclass(frozen=True)
class SignalJob:
    """One simulation of an FMU between sampled inputs and outputs.

    Attributes:
        parameters: Start values by name.
        time: Communication points [s], (n,).
        inputs: Names.
        values: Of the inputs; row k is held over the step that ends at time[k], row 0 in
            initialisation, (n, len(inputs)).
        outputs: Names.
    """

    parameters: Mapping[str, float | int | bool | str]
    time: np.ndarray
    inputs: tuple[str, ...]
    values: np.ndarray
    outputs: tuple[str, ...]


def load(folder: Path) -> Callable[[SignalJob, Progress], np.ndarray]:
    """Return what runs jobs on the unpacked FMU in a folder.

    Raises:
        WorkerError: If it is no FMU for co-simulation by FMI 2 or 3.
    """
    try:
        description = fmpy.read_model_description(str(folder), validate=False)
    except Exception as cause:  # whatever FMPy finds wrong with the file
        raise WorkerError(f"is not a readable FMU: {cause}") from cause
    if description.coSimulation is None or description.fmiVersion == "1.0":
        raise WorkerError(
            f"is an FMU of FMI {description.fmiVersion}"
            f"{'' if description.coSimulation else ' without co-simulation'}; needed is FMI 2 or 3"
            " co-simulation"
        )

    def run(job: SignalJob, progress: Progress) -> np.ndarray:
        references = _references(description)
        named = {*job.inputs, *job.outputs, *job.parameters}
        unknown = sorted(named - set(references))
        if unknown:
            raise WorkerError(
                f"has no variable {', '.join(unknown)}; it has {', '.join(sorted(references))}"
            )
        said: list[str] = []

        def log(*message: Any) -> None:
            # FMI 2: environment, instance, status, category, text; FMI 3: without the instance.
            if message[-3] >= _ERROR:
                said.append(message[-1].decode(errors="replace").strip())

        try:
            fmu = instantiate_fmu(
                str(folder), description, "CoSimulation", debug_logging=True, logger=log
            )
            try:
                return _simulate(fmu, description, job, references, progress)
            finally:
                _free(fmu)
        except Exception as cause:  # FMPy raises bare Exception for most refusals
            reason = said[-1].splitlines()[-1] if said and said[-1] else cause
            raise WorkerError(f"{type(cause).__name__}: {reason}") from cause

    return run


def _references(description: fmpy.model_description.ModelDescription) -> dict[str, int]:
    return {v.name: v.valueReference for v in description.modelVariables}


def _simulate(
    fmu: FMU2Slave | FMU3Slave,
    description: fmpy.model_description.ModelDescription,
    job: SignalJob,
    references: dict[str, int],
    progress: Progress,
) -> np.ndarray:
    """Return the outputs at the ends of the steps, (n, len(job.outputs))."""
    inputs = [references[name] for name in job.inputs]
    outputs = [references[name] for name in job.outputs]
    time, last = job.time, len(job.time) - 1
    answers = np.empty((last + 1, len(outputs)))
    if isinstance(fmu, FMU3Slave):
        put, get = fmu.setFloat64, fmu.getFloat64
        apply_start_values(fmu, description, dict(job.parameters))
        fmu.enterInitializationMode(startTime=time[0], stopTime=time[-1])
    else:
        put, get = fmu.setReal, fmu.getReal
        fmu.setupExperiment(startTime=time[0], stopTime=time[-1])
        apply_start_values(fmu, description, dict(job.parameters))
        fmu.enterInitializationMode()
    put(inputs, job.values[0].tolist())
    fmu.exitInitializationMode()
    answers[0] = get(outputs)
    for k in range(1, last + 1):
        put(inputs, job.values[k].tolist())
        fmu.doStep(time[k - 1], time[k] - time[k - 1])
        answers[k] = get(outputs)
        if k % _REPORT_EVERY == 0 or k == last:
            progress(k, last)
    fmu.terminate()
    return answers


def _free(fmu: FMU2Slave | FMU3Slave) -> None:
    # Not FMPy's freeInstance, which unloads the library: PythonFMU's crashes then.
    if isinstance(fmu, FMU3Slave):
        fmu.fmi3FreeInstance(fmu.component)
    else:
        fmu.fmi2FreeInstance(fmu.component)
