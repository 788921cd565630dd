"""An output is computed when it is read, once, and only then: outputs.py FMU."""

import sys

import numpy as np
from fmpy.fmi1 import FMICallException
from fmu import POSE, Fmu, require_error

COMPLIANCE = ["compliance.xx", "compliance.zz"]
fmu = Fmu(sys.argv[1])
instance = fmu.instance().start()
robot = sys.modules["elastic_robot.robot"].ElasticRobot
computed = []


def counted(name):
    method = getattr(robot, name)

    def call(self):
        computed.append(name)
        return method(self)

    setattr(robot, name, call)


for output in ("tcp", "compliance", "deviation"):
    counted(output)


def computes(work):
    computed.clear()
    work()
    return list(computed)


def reads(names):
    return computes(lambda: instance.get(names))


assert reads(POSE) == ["tcp"]
assert reads(POSE) == []
for k in range(3):
    instance.set({"force.z": -100.0 * k, "moment.x": 1.0})
    assert instance.get(["force.z"]) == [-100.0 * k]
    assert computes(lambda: instance.step(0.01)) == []
    assert reads(POSE[:2]) == ["tcp"]
    assert reads([*POSE, *COMPLIANCE]) == ["compliance"]
    assert reads(COMPLIANCE) == []
for wrong in ({"force.z": float("nan")}, {"tcp.x": 0.0}, {"joint[2].stiffness": float("inf")}):
    try:
        instance.set({"moment.y": 3.0, **wrong})
    except FMICallException as error:
        require_error(error)
    else:
        raise AssertionError(f"{wrong} was taken")
assert instance.get(["moment.y"]) == [0.0]  # refused as a whole

# One that read at every step, and one that never did until now, show the same.
silent = fmu.instance().start()
for k in range(3):
    silent.set({"force.z": -100.0 * k, "moment.x": 1.0})
    silent.step(0.01)
np.testing.assert_array_equal(silent.get(), instance.get())

# An output that cannot be computed is told when it is read; the step before it is done.
tcp, failing = robot.tcp, fmu.instance().start()
failing.get(POSE)


def lost(self):
    raise ValueError("no pose")


robot.tcp = lost
failing.step(0.01)
try:
    failing.get(POSE)
except FMICallException as error:
    require_error(error)
else:
    raise AssertionError("an old pose was read")
robot.tcp = tcp
other = fmu.instance().start()
other.step(0.01)
np.testing.assert_array_equal(failing.get(POSE), other.get(POSE))

# After a reset, and where a state is restored, there is nothing old to read.
state, before = instance.slave.getFMUState(), instance.get()
instance.slave.reset()
instance.start()
np.testing.assert_array_equal(instance.get(), fmu.instance().start().get())
instance.slave.setFMUState(state)
np.testing.assert_array_equal(instance.get(), before)
