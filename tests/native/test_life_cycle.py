"""Calls out of their time, the end, and no instance at all; the table: tests/fmu/test_life_cycle.py."""

import ctypes
import re
import subprocess
import sys
from functools import partial
from pathlib import Path

import pytest
from fmpy.fmi1 import FMICallException
from fmpy.fmi2 import FMU2Slave
from native_fmu import TCP, NativeFmu

from coupling.native.compiler import SOURCES, host_platform

STEP = 0.004  # [s]


def refused(capfd, call, message: str) -> None:
    with pytest.raises(FMICallException):
        call()
    assert message in capfd.readouterr().err


def derive(native: NativeFmu, slave: FMU2Slave, unknown: str, known: str) -> list[float]:
    return slave.getDirectionalDerivative(native.of([unknown]), native.of([known]), [1.0])


def test_misuse_of_the_life_cycle_is_refused_with_a_sentence(native, capfd):
    slave, strings = native.slave(), native.references["trajectory"]
    for call, message in (
        (lambda: slave.doStep(0.0, 0.01), "expected initialisation's end before a step"),
        (
            lambda: native.start(slave).setupExperiment(startTime=1.0),
            "setup before initialisation is entered",
        ),
        (
            lambda: slave.enterInitializationMode(),
            "a reset before initialisation is entered",
        ),
        (
            lambda: slave.getReal([strings]),
            f"reference of a real variable: expected 0 to {strings - 1}, got {strings}",
        ),
        (
            lambda: slave.getString([strings - 1]),
            f"a string variable: expected {strings} to {strings + 4}, got {strings - 1}",
        ),
        (lambda: slave.getInteger([3]), "this FMU has real and string variables only"),
        (lambda: slave.doStep(0.0, float("nan")), "expected a finite number >= 0, got nan s"),
        (
            lambda: derive(native, slave, "force.z", "tcp.x"),
            "expected an output to differentiate, got force.z",
        ),
        (
            lambda: derive(native, slave, "tcp.x", "tcp.x"),
            "behind initialisation, a state to differentiate by, got tcp.x",
        ),
    ):
        refused(capfd, call, message)


CHOICES = {
    "mode": ("statick", "mode: expected one of dynamic, quasistatic, got 'statick'"),
    "torque_curve": (
        "cubic",
        "torque_curve: expected one of linear, backlash, spline, got 'cubic'",
    ),
    "initial_state": ("rest", "got 'rest'"),
    "trajectory": ("no 100% file.csv", "no 100% file.csv: does not exist"),
}
NUMBERS = {
    "joint[2].stiffness": "joint[2].stiffness: expected a number > 0, got -1.0 N.m/rad",
    "joint[5].backlash": "joint[5].backlash: expected a number >= 0, got -1.0 rad",
}
SPRINGS = (
    ({"anchor.kxx": 1e6, "anchor.kyy": -1.0}, "got -1, 0, 1e+06 N/m"),
    ({"anchor.kxy": 5.0}, "got -5, 0, 5 N/m"),
)


def test_a_wrong_value_is_refused_with_a_sentence_and_a_right_one_taken_next(native, capfd):
    for name, (text, message) in CHOICES.items():
        refused(capfd, partial(native.started, **{name: text}), message)
    for name, message in NUMBERS.items():
        refused(capfd, partial(native.set, native.slave(), {name: -1.0}), message)
    for stiffness, message in SPRINGS:
        slave = native.started()
        native.set(slave, stiffness)
        refused(capfd, partial(slave.doStep, 0.0, STEP), f"no eigenvalue below 0, {message}")
        native.set(slave, dict.fromkeys(stiffness, 0.0))
        slave.doStep(0.0, STEP)


def test_after_the_end_there_are_values_and_states_but_no_steps(native, capfd):
    """FMI 2.0: until a reset, or a state from before."""
    slave = native.started()
    slave.doStep(0.0, STEP)
    state, before = slave.getFMUState(), native.get(slave, *TCP)
    slave.terminate()
    for call in (
        lambda: slave.doStep(STEP, STEP),
        lambda: native.set(slave, {"force.z": 1.0}),
        lambda: slave.setString(native.of(["mode"]), ["dynamic"]),
        lambda: slave.setupExperiment(startTime=0.0),
        slave.enterInitializationMode,
        slave.exitInitializationMode,
        slave.terminate,
    ):
        refused(
            capfd, call, "expected a reset or an earlier state after the simulation's termination"
        )
    assert native.get(slave, *TCP) == before
    slave.setFMUState(state)
    slave.doStep(STEP, STEP)
    slave.terminate()
    slave.reset()
    native.start(slave)
    slave.doStep(0.0, STEP)
    assert native.get(slave, *TCP) == before


NO_INSTANCE = """
import ctypes, sys
library = ctypes.CDLL(sys.argv[1])
for name in sys.argv[2:]:
    print(name, getattr(library, name)(*[ctypes.c_void_p(None)] * 12), flush=True)
"""


@pytest.mark.parametrize("fmi", ["2", "3"])
def test_no_instance_is_answered_with_an_error_by_every_function(fmi, pair):
    platform = host_platform()
    folder = pair.folder2 if fmi == "2" else pair.folder3
    named = platform.name if fmi == "2" else platform.machine
    library = folder / "binaries" / named / f"ElasticRobot{platform.suffix}"
    header = Path(SOURCES, "fmi", f"fmi{fmi}Functions.h").read_text()
    found = set(re.findall(rf"fmi{fmi}FullName\((fmi{fmi}\w+)\)", header))
    exported = ctypes.CDLL(str(library))
    asked = sorted(
        name
        for name in found
        if hasattr(exported, name) and not re.search("Instantiate|GetVersion|TypesPlatform", name)
    )
    assert {f"fmi{fmi}DoStep", f"fmi{fmi}Reset", f"fmi{fmi}FreeInstance"} <= set(asked)
    done = subprocess.run(
        [sys.executable, "-c", NO_INSTANCE, str(library), *asked], capture_output=True, text=True
    )
    assert done.returncode == 0, done.stdout
    answers = dict(line.split() for line in done.stdout.splitlines())
    assert answers.pop(f"fmi{fmi}FreeInstance") is not None
    assert set(answers.values()) == {"3"}, answers
