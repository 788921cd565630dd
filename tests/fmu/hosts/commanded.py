"""Drives that follow commands given at the starts of steps: commanded.py FMU."""

import functools
import sys
from pathlib import Path

import numpy as np
from fmpy.fmi1 import FMICallException
from fmu import POSTURE, Fmu, require_error

JOINTS = range(1, 7)
REST = np.array(list(POSTURE.values()))
AMPLITUDE, OMEGA = 0.2, 2.0 * np.pi * 0.8
TCP = ["tcp.x", "tcp.y", "tcp.z"]
EXACT = {"torque_curve": "linear"}


def swing(time):
    """q, q', q'' of all axes, which swing about a posture, from a turning point at time 0."""
    c, s = AMPLITUDE * np.cos(OMEGA * time), AMPLITUDE * np.sin(OMEGA * time)
    return REST + AMPLITUDE - c, np.full(6, OMEGA * s), np.full(6, OMEGA**2 * c)


def through(time):
    """The same motion, which is in full swing at time 0."""
    return tuple(
        part - (AMPLITUDE if order == 0 else 0.0)
        for order, part in enumerate(swing(time - 0.25 * 2.0 * np.pi / OMEGA))
    )


def command(motion):
    parts = zip(("q_cmd", "qd_cmd", "qdd_cmd"), motion, strict=True)
    return {f"{name}[{i}]": part[i - 1] for name, part in parts for i in JOINTS}


def tell_jerk(instance, time, motion):
    width = 1e-4
    jerk = (motion(time + width)[2] - motion(time - width)[2]) / (2.0 * width)
    references = [fmu.references[f"qdd_cmd[{i}]"] for i in JOINTS]
    instance.slave.setRealInputDerivatives(references, [1] * 6, jerk.tolist())


@functools.cache
def driven(motion, steps, trajectory="", jerk=False, seen=lambda motion: motion):
    """TCP at the ends of steps of some lengths."""
    strings = {**EXACT, "trajectory": trajectory}
    instance = fmu.instance().start(tolerance=1e-8, strings=strings, **command(motion(0.0)))
    path = []
    for size in steps:
        instance.set(command(seen(motion(instance.time))))
        if jerk:
            tell_jerk(instance, instance.time, motion)
        instance.step(size)
        path.append(instance.get(TCP))
    instance.free()
    return np.array(path)


@functools.cache
def along_trajectory(motion, steps):
    file = "motion.npz"
    time = np.arange(0.0, sum(steps) + 0.002, 1.0 / 1024)
    table = np.column_stack([time, np.array([np.concatenate(motion(t)) for t in time])])
    names = [f"{name}{i}" for name in ("q", "qd", "qdd") for i in JOINTS]
    np.savez(file, columns=["time", *names], data=table)
    return driven(motion, steps, str(Path(file).resolve()))


def error(motion, steps, **options):
    away = driven(motion, steps, **options) - along_trajectory(motion, steps)
    return np.linalg.norm(away, axis=1).max()


def order():
    """At 64 steps a second 1.2 um; the order is the fourth."""
    errors = [error(swing, (1.0 / rate,) * (rate // 4)) for rate in (64, 128)]
    assert errors[0] < 2e-6, errors
    assert np.log2(errors[0] / errors[1]) > 3.7, errors


def uneven():
    """Steps of 4 to 16 ms in any order."""
    steps = np.array([3, 1, 4, 2, 2, 4, 1, 3, 3, 4, 4, 1, 1, 2] * 2) / 256
    assert error(swing, tuple(steps)) < 2e-6


def told_jerk():
    """In full swing from the start the first step knows no jerk but the told one: 49 um without it."""
    steps = (1.0 / 64,) * 16
    assert error(through, steps, jerk=True) < 2e-6
    assert error(through, steps) > 2e-5


def quantised():
    """Angles of a coarse encoder beside true rates move the tool rigidly only: no more than they say."""
    resolution, steps = 2.0 * np.pi / 2**17, (1.0 / 128,) * 64

    def seen(motion):
        q, *rates = motion
        return np.round(q / resolution) * resolution, *rates

    away = driven(swing, steps, seen=seen) - driven(swing, steps)
    levers = 6.0  # sum of the axes' distances from the tool, at most [m]
    assert np.linalg.norm(away, axis=1).max() < 0.5 * resolution * levers


def jump():
    """The robot is there at once, its deflections as they were; the vertical axis loads it alike."""
    names = [f"deflection[{k}]" for k in range(1, 12)]
    instance = fmu.instance().start(strings=EXACT)
    before, angle = instance.get(names), 0.0
    for k in range(40):
        angle += {5: 0.1, 20: -0.3}.get(k, 0.0)
        instance.set({"q_cmd[1]": angle})
        instance.step(0.01 if k % 2 else 0.003)
        x, y = instance.get(["rigid.x", "rigid.y"])
        np.testing.assert_allclose(np.arctan2(y, x), angle, rtol=0, atol=1e-12)
        np.testing.assert_allclose(instance.get(names), before, rtol=0, atol=1e-9)


def quasistatic():
    """No memory: the place at a step's end is that of the command alone."""
    free, strings = fmu.instance(), {**EXACT, "mode": "quasistatic"}
    free.start(strings=strings)
    for k in range(5):
        q, qd, qdd = swing(0.1 + 0.02 * k)
        free.set(command((q, qd, qdd)))
        free.step(0.02)
        alone = fmu.instance().start(strings=strings)
        alone.set(command((q + 0.02 * qd + 0.5 * 0.02**2 * qdd, 0 * qd, 0 * qdd)))
        alone.step(0.02)
        np.testing.assert_allclose(free.get(TCP), alone.get(TCP), rtol=0, atol=1e-12)


def move(instance, first, count=12):
    rows = []
    for k in range(first, first + count):
        instance.set(command(swing(0.2 + instance.time)))
        if k % 3 == 2:
            tell_jerk(instance, 0.2 + instance.time, swing)
        instance.set({"force_rate.z": 1e4 * (k % 4 - 1)})
        instance.step([0.004, 0.011, 0.0007, 0.02][k % 4])
        rows.append(instance.get())
    return np.array(rows)


def state():
    """Also serialised, also into another instance, after a refused step as if there had been none."""
    instance = fmu.instance().start(**command(swing(0.2)))
    move(instance, 0)
    time, kept = instance.time, instance.slave.getFMUState()
    data = instance.slave.serializeFMUstate(kept)
    expected = move(instance, 12)
    fresh = fmu.instance()
    for other in (instance, fresh):
        for again in (kept, other.slave.deSerializeFMUstate(data)):
            other.slave.setFMUState(again)
            other.time = time
            other.set({"anchor.kxx": -1.0, **command(np.ones((3, 6)))})
            try:
                other.step(0.01)
            except FMICallException as refusal:
                require_error(refusal)
            else:
                raise AssertionError("a spring that pushes")
            other.time = time
            other.set({"anchor.kxx": 0.0})
            np.testing.assert_array_equal(move(other, 12), expected)
    # The memory of commands ends with a reset.
    instance.slave.reset()
    instance.start(**command(swing(0.2)))
    first = move(instance, 0)
    np.testing.assert_array_equal(first, move(fmu.instance().start(**command(swing(0.2))), 0))


if __name__ == "__main__":
    fmu = Fmu(sys.argv[1])
    for claim in (order, uneven, told_jerk, quantised, jump, quasistatic, state):
        claim()
