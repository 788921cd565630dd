"""The robot's FMU (FMI 2) for `replay`: a command and wrenches in, poses of the TCP out."""

import ctypes
import sys
import tempfile
from collections.abc import Mapping
from dataclasses import dataclass, field
from pathlib import Path

import fmpy
import fmpy.fmi2 as fmi2
import numpy as np
from fmpy.logging import addLoggerProxy
from fmpy.simulation import apply_start_values

KINDS = ("force", "moment", "force_rate", "moment_rate")
INPUTS = [f"{kind}.{axis}" for kind in KINDS for axis in "xyz"]
OUTPUTS = [f"tcp.{name}" for name in ("x", "y", "z", "qx", "qy", "qz", "qw")]
SCALED = {"stiffness", "damping", "backlash", "wrench"}
ERROR = 3  # of fmi2Status


@dataclass(frozen=True)
class Settings:
    """How a command is replayed.

    Attributes:
        curve: "linear", "backlash" or "spline"; the case's if empty.
        tolerance: Error allowed at the TCP [m], the tolerance of the experiment.
        values: FMU's parameters by name, instead of the robot's own.
        scale: Factors of all "stiffness", "damping", "backlash", and of the "wrench".
    """

    curve: str = ""
    tolerance: float = 1e-8
    values: Mapping[str, float] = field(default_factory=dict)
    scale: Mapping[str, float] = field(default_factory=dict)


class Robot:
    """A robot FMU, unpacked and loaded; of every FMU one in a process.

    Args:
        file: The FMU.
    """

    def __init__(self, file: Path) -> None:
        # A library that is loaded cannot be removed on every system.
        self._unpacked = tempfile.TemporaryDirectory(prefix="replay_", ignore_cleanup_errors=True)
        folder = self._unpacked.name
        fmpy.extract(str(file), unzipdir=folder)
        self._description = fmpy.read_model_description(folder, validate=False)
        self._variables = {v.name: v for v in self._description.modelVariables}
        self._slave = fmi2.FMU2Slave(
            guid=self._description.guid,
            unzipDirectory=folder,
            modelIdentifier=self._description.coSimulation.modelIdentifier,
        )
        self._callbacks = fmi2.fmi2CallbackFunctions(
            logger=_LOGGER,
            allocateMemory=fmi2.fmi2CallbackAllocateMemoryTYPE(fmi2.calloc),
            freeMemory=fmi2.fmi2CallbackFreeMemoryTYPE(fmi2.free),
        )
        addLoggerProxy(ctypes.byref(self._callbacks))

    def poses(
        self, command: Path, time: np.ndarray, wrench: np.ndarray, settings: Settings
    ) -> np.ndarray:
        """Return the poses x .. qw of the TCP in base axes at `time` (k,) [s], (k, 7).

        Row k of `wrench` (k, 12) is wrench and rate at the start of the step that ends at time[k], row 0
        that of initialisation.
        """
        slave = self._slave
        slave.instantiate(callbacks=self._callbacks, loggingOn=True)
        slave.setupExperiment(startTime=time[0])
        start: dict[str, object] = {"trajectory": str(command.resolve()), "mode": "dynamic"}
        start["initial_state"] = "equilibrium"
        start["tcp_tolerance"] = settings.tolerance
        if settings.curve:
            start["torque_curve"] = settings.curve
        apply_start_values(slave, self._description, start | self._parameters(settings))
        inputs, outputs = (
            [self._variables[name].valueReference for name in names] for names in (INPUTS, OUTPUTS)
        )
        slave.enterInitializationMode()
        slave.setReal(inputs, wrench[0].tolist())
        slave.exitInitializationMode()
        answers = [slave.getReal(outputs)]
        for k in range(1, len(time)):
            slave.setReal(inputs, wrench[k].tolist())
            slave.doStep(time[k - 1], time[k] - time[k - 1])
            answers.append(slave.getReal(outputs))
        slave.terminate()
        slave.fmi2FreeInstance(slave.component)
        return np.array(answers)

    def _parameters(self, settings: Settings) -> dict[str, float]:
        """Return the values of the parameters that are not the robot's own, by name."""
        unknown = {*settings.values} - {*self._variables} | {*settings.scale} - SCALED
        if unknown:
            raise ValueError(
                f"expected parameters of the FMU or one of {', '.join(sorted(SCALED))} as a factor, got"
                f" {', '.join(sorted(unknown))}"
            )
        scaled = {
            name: float(variable.start) * settings.scale[kind]
            for name, variable in self._variables.items()
            if (kind := name.rpartition(".")[2]) in settings.scale
        }
        return scaled | dict(settings.values)


def _log(environment: object, instance: object, status: int, category: bytes, text: bytes) -> None:
    if status >= ERROR:
        print(text.decode(errors="replace"), file=sys.stderr)


# FMPy's proxy keeps it for all later instances of the process.
_LOGGER = fmi2.fmi2CallbackLoggerTYPE(_log)
