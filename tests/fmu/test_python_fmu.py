"""The FMU in Python gives what the native one does; what it does not have it refuses."""

from dataclasses import replace

import numpy as np
import pytest
from places import REFERENCE
from random_robots import make_robot

from coupling.fmu_export.build import KINDS, BuildOptions, build_fmu
from elastic_robot.description import Robot
from elastic_robot.drive import Drive
from elastic_robot.fmi.interface import blocks
from elastic_robot.gear_parts import StopElement

HEIGHT = 0.2356  # of the TCP where all drives are at 0 [m]
TIME = [0.0, 0.004, 0.011, 0.02, 0.031]
FORCE = {"force.z": [0.0, -300.0, -300.0, 200.0, 0.0], "force_rate.x": [0.0, 1e4, 0.0, 0.0, 0.0]}
RATES = {"qd_cmd[1]": [0.1] * 5, "q_cmd[1]": [0.1 * t for t in (0.0, *TIME[:-1])]}
SPRING = {"anchor.kzz": [1e5] * 5, "anchor.z": [0.5] * 5, "anchor.vz": [0.0, 0.0, 0.0, -0.1, -0.1]}
PLANE = {
    "contact.stiffness": [1e6] * 5,
    "contact.friction": [0.2] * 5,
    "contact.dissipation": [5.0] * 5,
    "anchor.z": [HEIGHT] * 5,
}
CASES = {
    "held": ({}, FORCE),
    "commanded": ({"torque_curve": "spline"}, FORCE | RATES),
    "on a spring": ({"initial_state": "undeflected"}, FORCE | SPRING),
    "in contact": ({"torque_curve": "linear"}, FORCE | PLANE),
    "in contact with backlash": ({"torque_curve": "backlash"}, FORCE | PLANE),
    "at rest in contact": ({"mode": "quasistatic"}, FORCE | PLANE),
    "servo": ({"drive": "servo", "torque_curve": "linear"}, FORCE | RATES),
    "torque": ({"drive": "torque"}, {"torque_cmd[1]": [0.0, 50.0, 50.0, -50.0, 0.0]}),
    "from above": ({"mode": "quasistatic", "initial_state": "equilibrium_from_above"}, FORCE),
    "tuned": (
        {},
        {"gravity.x": [0.0, 0.0, 3.0, 3.0, 0.0], "joint[1].stiffness": [3e6, 1e6] * 2 + [5e6]},
    ),
}


def robot() -> Robot:
    """Three joints, the first with a motor and hysteresis."""
    whole = make_robot(12, 3)
    drive = Drive(30.0, 20.0, 4e3, 2e5, friction=20.0, viscous=10.0)
    elements = (StopElement(40.0, 2e-5), StopElement(30.0, 1e-4))
    first = replace(whole.joints[0], stiffness=3e6, damping=500.0, drive=drive, hysteresis=elements)
    return replace(whole, joints=(first, *whole.joints[1:]))


@pytest.fixture(scope="module")
def fmus(tmp_path_factory):
    folder = tmp_path_factory.mktemp("fmus")
    return [build_fmu(robot(), folder / f"{kind}.fmu", BuildOptions(kind)) for kind in KINDS]


def test_all_outputs_are_those_of_the_native_fmu(fmus, run_fmu):
    """To 1e-5 of their usual sizes, where both may err by 1e-9 m at the TCP."""
    table = blocks(robot())
    outputs = [v for b in table.values() if b.causality == "output" for v in b.variables]
    jobs = [
        {
            "settings": settings,
            "time": TIME,
            "start": {"tcp_tolerance": 1e-9},
            "inputs": inputs,
            "outputs": [v.name for v in outputs],
        }
        for settings, inputs in CASES.values()
    ]
    size = np.array([v.nominal or 1.0 for v in outputs])
    python, native = (run_fmu(fmu, *jobs) for fmu in fmus)
    for name, one, other in zip(CASES, python, native, strict=True):
        assert "error" not in one, (name, one["error"])
        error = np.abs(one["values"] - other["values"]) / size
        assert error.max() < 1e-5, (
            name,
            outputs[int(error.max(axis=0).argmax())].name,
            error.max(),
        )
        assert np.ptp(other["values"], axis=0).any(), name


REFUSED = {
    "not finite": (
        {"inputs": {"force.x": [0.0, np.nan]}},
        "force.x: expected a finite number, got nan",
    ),
    "no file": ({"settings": {"trajectory": "no 100%.csv"}}, "no 100%.csv: does not exist"),
    "no mode": ({"settings": {"torque_curve": "cubic"}}, "torque_curve: expected one of linear"),
    "an output": ({"start": {"tcp.x": 1.0}}, "tcp.x is an output and cannot be set"),
}


def test_errors_are_sentences_and_the_process_goes_on(fmus, run_fmu):
    right = {"time": [0.0, 0.01], "outputs": ["tcp.x"]}
    jobs = [job for wrong, _ in REFUSED.values() for job in (right | wrong, right)]
    answers = run_fmu(fmus[0], *jobs)
    said = answers[0]["stderr"]
    for (name, (_, sentence)), wrong, after in zip(
        REFUSED.items(), answers[::2], answers[1::2], strict=True
    ):
        assert "failed with status" in str(wrong["error"]), name
        assert sentence in said, name
        assert np.isfinite(after["values"]).all(), name


def test_states_are_refused_not_half_saved(fmus, forked, tmp_path):
    """PythonFMU's own would be the variables without the robot's state."""
    script = tmp_path / "states.py"
    script.write_text(f"""
import sys
sys.path.append({str(REFERENCE.parent / "fmu" / "hosts")!r})
from fmu import Fmu
slave = Fmu(sys.argv[1]).instance().start().slave
try:
    slave.getFMUState()
except Exception as error:
    print(error)
""")
    done = forked(script, fmus[0])
    assert "failed with status 3" in done.stdout, done.stderr
    assert "states are asked for; this FMU has none" in done.stderr
