"""Absurd values and late starts: hard_cases.py FMU absurd|late."""

import sys
import time
from functools import partial
from pathlib import Path

import numpy as np
from fmpy.fmi1 import FMICallException
from fmu import Fmu, require_error

fmu = Fmu(sys.argv[1])
LONGEST = 3.0  # [s] of the process; a step took 37 and more
STEP = 1 / 256

ABSURD = {
    "force": {"force.z": -1e12},
    "enormous force": {"force.x": 1e300},
    "moment": {"moment.x": 1e14},
    "acceleration": {"qdd_cmd[2]": 1e12},
    "enormous acceleration": {"qdd_cmd[2]": 1e300},
    "rate": {"qd_cmd[1]": 1e6, "qd_cmd[3]": 1e9},
    "spring": {"anchor.x": 1e12, "anchor.kxx": 1e12},
    "enormous spring": {"anchor.kxx": 1e300, "anchor.x": 1.0},
}


def refuse(name, call):
    """Make a call that shall be refused before long."""
    print(f"## {name}", file=sys.stderr, flush=True)
    start = time.process_time()
    try:
        call()
    except FMICallException as error:
        require_error(error)
    else:
        raise AssertionError(f"{name}: no error")
    taken = time.process_time() - start
    assert taken < LONGEST, f"{name}: {taken} s"


def absurd():
    """Each is refused in time, and what follows is as if it had not been asked for."""
    steps = [(name, values, size) for name, values in ABSURD.items() for size in (0.01, 1.0)]
    steps.append(("long step", {}, 1e9))
    for settings in ({}, {"torque_curve": "linear"}):
        instance, twin = fmu.instance().start(strings=settings), fmu.instance()
        twin.start(strings=settings)
        for name, values, size in steps:
            before = instance.get()
            inputs = dict.fromkeys(values, 0.0)
            instance.set(values)
            refuse(name, partial(instance.slave.doStep, instance.time, size))
            np.testing.assert_array_equal(instance.get(), before, err_msg=name)
            instance.set(inputs)
            for one in (instance, twin):
                one.step(STEP)
            np.testing.assert_array_equal(instance.get(), twin.get(), err_msg=name)
        instance.free()
        twin.free()
    quiet = fmu.instance().start(strings={"mode": "quasistatic"})
    quiet.step(1e9)  # rest is rest
    for name in ("force", "enormous force", "moment"):
        quiet.set(ABSURD[name])
        refuse(name, lambda: quiet.slave.doStep(quiet.time, STEP))
        quiet.set(dict.fromkeys(ABSURD[name], 0.0))


def motion(start, step, **settings):
    """Outputs of a run whose master counts start + k step."""
    instance = fmu.instance().start(start, strings=settings)
    rows = []
    for k in range(15):
        swing = {"q_cmd[1]": 0.06 * np.sin(5 * k * step), "qd_cmd[1]": 0.3 * np.cos(5 * k * step)}
        instance.set({"force.z": -500.0 * np.sin(30 * k * step), **swing})
        instance.slave.doStep(start + k * step, step)
        rows.append(instance.get())
    instance.free()
    return np.array(rows)


def trajectory(start):
    """A file whose times are doubles wherever it starts."""
    time, turn = np.arange(65) / 128, 5.0
    columns = [f"{kind}{i}" for kind in ("q", "qd", "qdd") for i in range(1, 7)]
    swing = 0.2 * (1 - np.cos(turn * time)), np.sin(turn * time), turn * np.cos(turn * time)
    table = np.repeat(swing, 6, axis=0).T
    file = Path(f"{start:g}.npz").resolve()
    np.savez(file, columns=["time", *columns], data=np.column_stack([start + time, table]))
    return str(file)


def late():
    """At any start and by steps of any length the outputs are those of a start at 0, bit for bit."""
    for step in (0.004, STEP):
        expected, along = motion(0.0, step), motion(0.0, step, trajectory=trajectory(0.0))
        for start in (8.5e6, -3e7, 1e9):
            np.testing.assert_array_equal(motion(start, step), expected)
            found = motion(start, step, trajectory=trajectory(start))
            np.testing.assert_array_equal(found, along)
    instance = fmu.instance().start(1e9)
    refuse("elsewhere", lambda: instance.slave.doStep(1e9 + 1e-5, STEP))


{"absurd": absurd, "late": late}[sys.argv[2]]()
