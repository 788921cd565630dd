"""What an FMU must hold to, one by one: contract.py FMU CLAUSE ..."""

import sys
import traceback

import numpy as np
from fmpy.fmi1 import FMICallException
from fmu import Fmu

TCP = ["tcp.x", "tcp.y", "tcp.z"]


def shaken(instance, steps=5):
    for k in range(steps):
        instance.set({"force.z": -400.0 * (k % 2)})
        instance.step(0.004)
    return instance.get(TCP)


def rollback(fmu):
    instance = fmu.instance().start()
    shaken(instance)
    time, state = instance.time, instance.slave.getFMUstate()
    expected = shaken(instance)
    instance.slave.setFMUstate(state)
    instance.time = time
    np.testing.assert_array_equal(shaken(instance), expected)


def serialised_state(fmu):
    instance, other = fmu.instance().start(), fmu.instance().start()
    shaken(instance)
    data = instance.slave.serializeFMUstate(instance.slave.getFMUstate())
    other.slave.setFMUstate(other.slave.deSerializeFMUstate(data))
    other.time = instance.time
    np.testing.assert_array_equal(shaken(other), shaken(instance))


def refused(call):
    try:
        call()
    except FMICallException:
        return
    raise AssertionError("it was taken")


def not_a_number(fmu):
    instance = fmu.instance().start()
    refused(lambda: instance.set({"force.z": float("nan")}))


def negative_stiffness(fmu):
    instance = fmu.instance().start()

    def call():
        instance.set({"joint[2].stiffness": -1.0})
        instance.step(0.01)

    refused(call)


def parameters_before_a_refused_step(fmu):
    strings = {"mode": "quasistatic"}
    before = fmu.instance().start(strings=strings).get()
    instance = fmu.instance().start(strings=strings)  # which has not read its outputs yet
    instance.set({"gravity.z": -1e9})
    refused(lambda: instance.step(0.01))
    instance.set({"gravity.z": -9.81})
    np.testing.assert_array_equal(instance.get(), before)


def unknown_text(fmu):
    instance = fmu.instance()
    refused(lambda: instance.start(strings={"mode": "statick"}))


def step_from_elsewhere(fmu):
    instance = fmu.instance().start()
    refused(lambda: instance.slave.doStep(5.0, 0.01))


def initial_outputs(fmu):
    assert np.linalg.norm(fmu.instance().start().get(TCP)) > 0.5


if __name__ == "__main__":
    fmu, broken = Fmu(sys.argv[1]), []
    for clause in sys.argv[2:]:
        try:
            globals()[clause](fmu)
        except AssertionError:
            traceback.print_exc()
            broken.append(clause)
    if broken:
        raise AssertionError(f"broken: {' '.join(broken)}")
