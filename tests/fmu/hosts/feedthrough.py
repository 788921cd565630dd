"""What outputs follow at a communication point: feedthrough.py FMU STEP.

FMI 2, 2.2.8: `dependencies` of outputs are those "at the current Communication Point"; here an input is
set there and every output read again, without a step between.  STEP is 1 where the FMU declares what
outputs follow over a step.
"""

import sys

import numpy as np
from fmpy import extract, read_model_description
from fmpy.fmi2 import FMU2Slave
from fmpy.fmi3 import FMU3Slave

H = 0.01
file, over_step = sys.argv[1], sys.argv[2] == "1"
description = read_model_description(file)
variables = {v.name: v for v in description.modelVariables}
reals = [v for v in variables.values() if v.type in ("Real", "Float64")]
inputs = [v.name for v in reals if v.causality == "input"]
outputs = [u.variable.name for u in description.outputs]
declared = {u.variable.name: {d.name for d in u.dependencies} for u in description.outputs}
of_exchange = description.modelExchange is not None


class Robot:
    """The robot in one mode, after a step."""

    def __init__(self, mode):
        two = description.fmiVersion.startswith("2")
        self.fmu = (FMU2Slave if two else FMU3Slave)(
            guid=description.guid,
            unzipDirectory=extract(file),
            modelIdentifier=description.coSimulation.modelIdentifier,
            instanceName=mode,
        )
        self.fmu.instantiate()
        if two:
            self.fmu.setupExperiment(startTime=0.0)
            self.fmu.setString([variables["mode"].valueReference], [mode])
            self.fmu.enterInitializationMode()
            self._set, self._get = self.fmu.setReal, self.fmu.getReal
        else:
            self.fmu.setString([variables["mode"].valueReference], [mode])
            self.fmu.enterInitializationMode(startTime=0.0)
            self._set, self._get = self.fmu.setFloat64, self.fmu.getFloat64
        self.set({"q_cmd[2]": -0.3, "q_cmd[3]": 0.5, "q_cmd[5]": 0.6})
        self.fmu.exitInitializationMode()
        self.set({"force.x": 300.0, "force.z": -500.0})
        self.step(0.0)

    def set(self, values):
        self._set([variables[name].valueReference for name in values], list(values.values()))

    def get(self, names):
        return np.array(self._get([variables[name].valueReference for name in names]))

    def step(self, time):
        self.fmu.doStep(currentCommunicationPoint=time, communicationStepSize=H)

    def derivative(self, unknown, known):
        call = self.fmu.getDirectionalDerivative
        return call([variables[unknown].valueReference], [variables[known].valueReference], [1.0])[
            0
        ]


def answering(robot):
    """Return, by output, the inputs that change it at once."""
    found = {name: set() for name in outputs}
    for known in inputs:
        (value,) = robot.get([known])
        before = robot.get(outputs)
        robot.set({known: value + (1e4 if known.startswith("anchor.k") else 1.0)})
        for name, was, now in zip(outputs, before, robot.get(outputs), strict=True):
            if was != now:
                found[name].add(known)
        robot.set({known: value})
    return found


for mode in ("dynamic", "quasistatic"):
    robot = Robot(mode)
    found = answering(robot)
    assert not any(found.values()), (mode, found)
    for name in outputs:
        follows = declared[name] & set(inputs)
        # Of the two interfaces of a native FMU, which have one list, model exchange follows at once.
        if over_step:
            i = name[-2] if name.startswith(("motor_angle", "motor_rate")) else "1"
            assert {f"q_cmd[{i}]", f"qd_cmd[{i}]"} <= follows, name
        elif name.startswith(("compliance", "contact.f")):
            assert all(k.startswith(("q_cmd", "qd_cmd")) for k in follows) or of_exchange, name
        else:
            assert all(known.startswith(("q_cmd", "qd_cmd")) for known in follows), (name, follows)
            assert of_exchange or not follows, (name, follows)
    if of_exchange:
        before = robot.get(["tcp.z"])[0]
        robot.set({"force.z": -501.0})
        robot.step(H)
        lower = robot.get(["tcp.z"])[0]
        other = Robot(mode)
        assert other.get(["tcp.z"])[0] == before
        other.set({"force.z": -499.0})
        other.step(H)
        slope = 0.5 * (other.get(["tcp.z"])[0] - lower)
        assert slope > 0.0
        assert abs(robot.derivative("tcp.z", "force.z") / slope - 1.0) < 1e-3, (mode, slope)
