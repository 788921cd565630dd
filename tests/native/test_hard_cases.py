"""Hard cases in the FMU of FMI 3.0, and what is no hard case."""

from __future__ import annotations

import time

import numpy as np
import pytest
from fmpy.fmi1 import FMICallException
from native_core import CoreError, with_settings
from random_robots import make_robot

from coupling.files.robot_file import find_robot, load_robot
from elastic_robot.settings import SETTINGS

STEP = 1 / 256  # [s]
LONGEST = 1.0  # [s] of the process


@pytest.mark.parametrize(
    ("name", "value", "size"),
    [
        ("force", [0.0, 0.0, -1e12], 0.01),
        ("force", [1e300, 0.0, 0.0], 1.0),
        ("qdd_cmd", [0.0, 1e12, 0.0, 0.0, 0.0, 0.0], 0.01),
        ("qd_cmd", [1e9] * 6, 1.0),
        ("force", [0.0] * 3, 1e9),
    ],
)
def test_absurd_values_are_refused_in_time_and_leave_no_trace(pair, capfd, name, value, size):
    slave, twin = pair.started(), pair.started()
    pair.set(slave, name, value)
    start, before = time.process_time(), pair.get(slave, "tcp.position")
    with pytest.raises(FMICallException):
        slave.doStep(0.0, size)
    assert time.process_time() - start < LONGEST
    said = capfd.readouterr().err
    assert "one of these is too large" in said or "expected at most 3600 s at a time" in said
    assert pair.get(slave, "tcp.position") == before
    pair.set(slave, name, [0.0] * len(value))
    for one in (slave, twin):
        one.doStep(0.0, STEP)
    assert pair.everything(slave) == pair.everything(twin)


@pytest.mark.parametrize("start", [1e9, -3e7])
def test_a_run_that_starts_late_is_that_from_zero(pair, start):
    found = []
    for origin in (0.0, start):
        slave = pair.fmi3()
        slave.enterInitializationMode(startTime=origin)
        slave.exitInitializationMode()
        pair.set(slave, "force", [100.0, 0.0, -500.0])
        for k in range(50):
            slave.doStep(origin + k * 0.004, 0.004)
        found.append(pair.everything(slave))
        assert pair.get(slave, "time") == pytest.approx(
            [origin + 0.2], abs=1e-15 * abs(origin) + 1e-9
        )
    assert found[0] == found[1]


def _drive(tmp_path, rng, joints):
    """A trajectory of 0.8 Hz, all axes by 0.2 rad, 4 ms samples over half a minute."""
    seconds, turn = np.arange(7501) * 0.004, 2 * np.pi * 0.8
    phase = turn * seconds[:, None] + rng.uniform(0.0, 6.0, joints)
    q = rng.uniform(-1.0, 1.0, joints) + 0.2 * np.sin(phase)
    blocks = {"q": q, "qd": 0.2 * turn * np.cos(phase), "qdd": -0.2 * turn**2 * np.sin(phase)}
    columns = ["time", *(f"{name}{i + 1}" for name in blocks for i in range(joints))]
    np.savez(
        tmp_path / "drive.npz", columns=columns, data=np.column_stack([seconds, *blocks.values()])
    )
    return tmp_path / "drive.npz"


@pytest.mark.parametrize("kind", ["linear", "backlash", "spline"])
def test_what_robots_do_needs_half_the_tries_or_less(kind, tmp_path):
    """Random forces of 2 kN every 0.1, 1 and 4 ms at 1e-9 m, and half a minute in one step at 1e-6 m."""
    half = {
        "most_tries": SETTINGS.most_tries / 2,
        "most_tries_per_longest": SETTINGS.most_tries_per_longest / 2,
        "usual_speed": SETTINGS.usual_speed / 10,
    }
    for robot in (load_robot(find_robot("icme2008")), *(make_robot(seed, 6) for seed in range(2))):
        rng = np.random.default_rng(1)
        core, drive = with_settings(robot, **half), _drive(tmp_path, rng, 6)
        for step, count in ((1e-4, 50), (1e-3, 50), (4e-3, 50)):
            core.reset(kind, 0.0, np.zeros(6), np.zeros(6), path=drive, tolerance=1e-9)
            for k in range(count):
                force = np.append(2e3 * rng.normal(size=3), np.zeros(3))
                core.step((k + 1) * step, np.zeros(6), force)
        core.reset(kind, 0.0, np.zeros(6), np.zeros(6), path=drive)
        core.step(30.0, np.zeros(6), np.array([100.0, 0.0, -300.0, 0.0, 0.0, 0.0]))
    core.reset(kind, 0.0, np.zeros(6), np.zeros(6))
    with pytest.raises(CoreError, match=r"needs more than|beyond"):
        core.step(1.0, np.zeros(6), np.array([0.0, 0.0, -1e9, 0.0, 0.0, 0.0]))
