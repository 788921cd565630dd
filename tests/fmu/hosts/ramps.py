"""Inputs that change over a step: ramps.py FMU."""

import sys

import numpy as np
from fmpy.fmi1 import FMICallException
from fmu import POSE, Fmu, require_error

EXACT = {"torque_curve": "linear"}
nan = float("nan")


def shaken(force, size, until, slope=None, through="call"):
    """The TCP under a force along z, whose rate is told by a call or as an input, or not at all."""
    instance = fmu.instance().start(tolerance=1e-9, strings=EXACT)
    for k in range(round(until / size)):
        instance.set({"force.z": force(k * size)})
        if slope is not None and through == "call":
            derive(instance, {"force.z": slope(k * size)})
        elif slope is not None:
            instance.set({"force_rate.z": slope(k * size)})
        instance.step(size)
    pose = instance.get()
    instance.free()
    return pose


def derive(instance, values, order=1):
    references = [fmu.references.get(name, name) for name in values]
    instance.slave.setRealInputDerivatives(references, [order] * len(values), list(values.values()))


def ramp():
    """Every 20 ms as well as every 0.5 ms; a stair of 0.5 ms with the mean of each step agrees too."""

    def force(time):
        return -5e3 * time

    def slope(time):
        return -5e3

    coarse, fine = (shaken(force, size, 0.04, slope)[:3] for size in (0.02, 5e-4))
    np.testing.assert_allclose(coarse, fine, rtol=0, atol=1e-10)
    stair = shaken(lambda time: force(time + 2.5e-4), 5e-4, 0.04)[:3]
    np.testing.assert_allclose(coarse, stair, rtol=0, atol=2e-9)
    held = shaken(force, 0.02, 0.04)[:3]
    assert np.abs(held - fine).max() > 1e-6


def second_order():
    """A sine of 5 Hz: halving the step leaves a quarter of the error, where held forces leave half."""

    def force(time):
        return 300.0 * np.sin(10.0 * np.pi * time)

    def slope(time):
        return 3e3 * np.pi * np.cos(10.0 * np.pi * time)

    exact = shaken(force, 1e-3, 0.2, slope)[:3]
    told = [np.abs(shaken(force, h, 0.2, slope)[:3] - exact).max() for h in (0.008, 0.004)]
    held = [np.abs(shaken(force, h, 0.2)[:3] - exact).max() for h in (0.008, 0.004)]
    assert np.log2(told[0] / told[1]) > 1.8, told
    assert np.log2(held[0] / held[1]) < 1.3, held


def moments():
    """All six, in both modes: at the end of a quasi-static step the wrench is the one that acts then."""
    wrench = [f"{name}.{c}" for name in ("force", "moment") for c in "xyz"]
    rates = dict(zip(wrench, [2e4, -1e4, 3e4, 1e3, 2e3, -1e3], strict=True))
    ends = []
    for size in (0.02, 0.02 / 64):
        for mode in ("dynamic", "quasistatic"):
            instance = fmu.instance().start(tolerance=1e-9, strings={**EXACT, "mode": mode})
            for k in range(round(0.02 / size)):
                instance.set({name: rate * k * size for name, rate in rates.items()})
                derive(instance, rates)
                instance.step(size)
            ends.append(instance.get(POSE))
    np.testing.assert_allclose(ends[0], ends[2], rtol=0, atol=1e-10)
    np.testing.assert_allclose(ends[1], ends[3], rtol=0, atol=1e-13)
    held = fmu.instance().start(strings={**EXACT, "mode": "quasistatic"})
    held.set({name: rate * 0.02 for name, rate in rates.items()})
    held.step(0.02)
    np.testing.assert_allclose(ends[1], held.get(POSE), rtol=0, atol=1e-13)


def same():
    """A derivative of the force is force_rate, that of the anchor its velocity; bit for bit."""

    def force(time):
        return -1e4 * time

    by_call, by_input = (
        shaken(force, 0.01, 0.05, lambda time: -1e4, through) for through in ("call", "input")
    )
    np.testing.assert_array_equal(by_call, by_input)
    poses = []
    for told in (True, False):
        instance = fmu.instance().start(strings=EXACT, **{"anchor.kzz": 1e6, "anchor.z": 0.9})
        for k in range(5):
            instance.set({"anchor.z": 0.9 + 1e-3 * k})
            if told:
                derive(instance, {"anchor.z": 0.1})
            else:
                instance.set({"anchor.vz": 0.1})
            instance.step(0.01)
        poses.append(instance.get())
        assert instance.get(["anchor.vz"]) == [0.1]
    np.testing.assert_array_equal(*poses)


def refusals():
    """Unknown variables, other orders, outputs, parameters, no numbers: nothing is changed."""
    wrong = {
        "unknown": ({"force.x": 1.0, 5000: 1.0}, 1),
        "beyond": ({(1 << 30) + 2: 1.0}, 1),
        "output": ({"force.x": 1.0, "tcp.x": 1.0}, 1),
        "parameter": ({"gravity.z": 1.0}, 1),
        "not a number": ({"force.x": 1.0, "force.y": nan}, 1),
        "order 2": ({"force.x": 1.0}, 2),
        "order 0": ({"force.x": 1.0}, 0),
    }
    instance, twin = fmu.instance().start(), fmu.instance().start()
    for name, (values, order) in wrong.items():
        print(f"## {name}", file=sys.stderr, flush=True)
        try:
            derive(instance, values, order)
        except FMICallException as refusal:
            require_error(refusal)
        else:
            raise AssertionError(name)
    instance.slave.setRealInputDerivatives([], [], [])
    for one in (instance, twin):
        one.step(0.01)
    # What is held over a step, and angles whose rate is an input, take a derivative without effect.
    derive(instance, {"q_cmd[2]": 3.0, "qd_cmd[1]": 2.0, "anchor.kxx": 1e9, "anchor.vx": 5.0})
    for one in (instance, twin):
        one.step(0.01)
    np.testing.assert_array_equal(instance.get(), twin.get())


if __name__ == "__main__":
    fmu = Fmu(sys.argv[1])
    for claim in (ramp, second_order, moments, same, refusals):
        claim()
