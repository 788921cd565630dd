"""What is no hard case; those that are: tests/fmu/test_hard_cases.py."""

from __future__ import annotations

import numpy as np
import pytest
from native_core import CoreError, with_settings
from random_robots import make_robot

from coupling.files.robot_file import find_robot, load_robot
from elastic_robot.settings import SETTINGS


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
