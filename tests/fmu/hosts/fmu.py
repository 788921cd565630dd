"""FMPy with names instead of value references; knows nothing of this project."""

import itertools
import os
import sys

import fmpy
import numpy as np
from fmpy.fmi2 import FMU2Slave

POSE = [f"tcp.{c}" for c in ("x", "y", "z", "qx", "qy", "qz", "qw")]
POSTURE = {f"q_cmd[{i + 1}]": q for i, q in enumerate([0.0, -0.3, 0.5, 0.0, 0.6, 0.0])}


def unpacked(file):
    """Return the folder of an FMU that is unpacked once: there later processes find its bytecode."""
    folder = f"{file}.{os.stat(file).st_mtime_ns}"
    return folder if os.path.isdir(folder) else fmpy.extract(file, unzipdir=folder)


class Fmu:
    """An unpacked FMU."""

    def __init__(self, file):
        self.description = fmpy.read_model_description(file, validate=False)
        self.folder = unpacked(file)
        self.references = {v.name: v.valueReference for v in self.description.modelVariables}
        self.outputs = [v.name for v in self.description.modelVariables if v.causality == "output"]
        self._numbers = itertools.count(1)

    def instance(self, name=None, logging=False):
        return Instance(self, name or f"robot{next(self._numbers)}", logging)


class Instance:
    """An instance whose variables go by name."""

    def __init__(self, fmu, name, logging):
        self.slave = FMU2Slave(
            guid=fmu.description.guid,
            unzipDirectory=fmu.folder,
            modelIdentifier=fmu.description.coSimulation.modelIdentifier,
            instanceName=name,
        )
        self._references, self._outputs = fmu.references, fmu.outputs
        self.slave.instantiate(loggingOn=logging)

    def start(self, time=0.0, tolerance=None, strings=(), posture=POSTURE, **reals):
        self.slave.setupExperiment(startTime=time)
        if tolerance is not None:
            self.set({"tcp_tolerance": tolerance})
        for name, value in dict(strings).items():
            self.slave.setString([self._references[name]], [value])
        self.slave.enterInitializationMode()
        posture = {name: q for name, q in posture.items() if name in self._references}
        if posture or reals:
            self.set({**posture, **reals})
        self.slave.exitInitializationMode()
        self.time = time
        return self

    def set(self, values):
        self.slave.setReal([self._references[name] for name in values], list(values.values()))

    def get(self, names=None):
        references = [self._references[name] for name in names or self._outputs]
        return np.array(self.slave.getReal(references))

    def step(self, size):
        self.slave.doStep(self.time, size)
        self.time += size

    def free(self):
        self.slave.freeInstance()


def require_error(exception, *statuses):
    """FMI's status 3, or 2 where another value or step may do: refused, and the instance can go on."""
    assert exception.status in (statuses or (2, 3)), exception


def push(k):
    """Return a force that shakes the robot through its backlash."""
    return {"force.x": 300.0 * np.sin(0.9 * k), "force.z": -400.0 * (k % 7 < 3)}


def _report_and_leave(*exception):
    """End past the destructors of a stock FMU's binary, which may corrupt the heap."""
    sys.__excepthook__(*exception)
    sys.stderr.flush()
    os._exit(1)


sys.excepthook = _report_and_leave
