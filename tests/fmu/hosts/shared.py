"""When python_host asks the slave, and when it does without: shared.py FMU."""

import sys

import numpy as np
from fmpy.fmi1 import FMICallException
from fmu import POSE, Fmu, require_error

COMPLIANCE = ["compliance.xx", "compliance.zz"]
fmu = Fmu(sys.argv[1])
instance, asked = fmu.instance(), []
slave = sys.modules["elastic_robot_slave"].ElasticRobotSlave


def counted(name):
    method = getattr(slave, name)

    def call(self, *arguments):
        asked.append(name)
        return method(self, *arguments)

    setattr(slave, name, call)


counted("get_real")
counted("set_real")


def asks(work):
    asked.clear()
    work()
    return list(asked)


def pushed(force):
    return lambda: instance.set({"force.z": force, "moment.x": 1.0})


instance.start()
# Initialisation is the slave's: an input that is set changes the initial state.
assert asked == ["set_real"]
assert asks(lambda: instance.get(POSE)) == ["get_real"]
assert asks(lambda: instance.get(POSE)) == []
for k in range(3):
    assert asks(pushed(-100.0 * k)) == []
    assert instance.get(["force.z"]) == [-100.0 * k]
    instance.step(0.01)
    assert asks(lambda: instance.get(POSE)) == []
    # The compliance costs, so it is computed when it is read and not before.
    assert asks(lambda: instance.get(COMPLIANCE)) == ["get_real"]
    assert asks(lambda: instance.get(COMPLIANCE)) == []
instance.step(0.01)
instance.step(0.01)  # nothing was read after the step before
assert asks(lambda: instance.get(POSE)) == ["get_real"]
assert asks(lambda: instance.set({"gravity.z": -9.0})) == ["set_real"]
assert asks(lambda: instance.get(["gravity.z", "force.z"])) == []
for wrong in ({"force.z": float("nan")}, {"tcp.x": 0.0}, {"joint[2].stiffness": float("inf")}):
    asked.clear()
    try:
        instance.set({"moment.y": 3.0, **wrong})
    except FMICallException as error:
        require_error(error)
    assert asked == ["set_real"]
assert instance.get(["moment.y"]) == [0.0]  # refused as a whole

# A slave that read at every step, and one that never did until now, show the same.
silent = fmu.instance().start()
for force in (0.0, -100.0, -200.0, -200.0, -200.0):
    silent.set({"force.z": force, "moment.x": 1.0})
    silent.step(0.01)
np.testing.assert_array_equal(silent.get(), instance.get())

# An output that cannot be computed is told when it is read; the step before it is done.
robot = sys.modules["elastic_robot.robot"].ElasticRobot
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

# After a reset the new slave's values are the ones that are set and read.
state, before = instance.slave.getFMUState(), instance.get()
instance.slave.reset()
assert asks(lambda: instance.set({"force.z": 5.0})) == ["set_real"]
instance.start()
assert asks(pushed(-7.0)) == []
assert instance.get(["force.z"]) == [-7.0]
assert silent.get(["force.z"]) == [-200.0]
instance.slave.setFMUState(state)
np.testing.assert_array_equal(instance.get(), before)
