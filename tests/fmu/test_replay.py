"""The judge of run folders (tests/helpers/replay.py) against solutions made with other engines."""

from __future__ import annotations

import numpy as np
import pytest
from conftest import reference

from coupling.files.csv_table import write_table

CURVES = {"linear": "nobacklash", "backlash": "backlash"}
POSE = ("time", "x", "y", "z", "qx", "qy", "qz", "qw")
LOADS = ("time", "fx", "fy", "fz", "mx", "my", "mz")
DRIVES = ("time", *(f"q{i}" for i in range(1, 7)))


@pytest.mark.parametrize("curve", CURVES)
def test_a_standing_robot_under_a_force_that_steps(judged, example_fmu, tmp_path, curve):
    """-2000 N on 0.1 <= t < 0.3 s; the path desired is the reference's, exact to 3e-14 m.

    Between its samples it is a cubic spline, to which a force that steps is a kink.
    """
    table = reference(f"c_step_{CURVES[curve]}")
    time = table[:, 0]
    before, behind = (time > 0.1005) & (time < 0.3005), (time > 0.0995) & (time < 0.2995)
    rows = np.sort(np.append(np.arange(len(time)), np.flatnonzero(before != behind)))
    second = np.append(False, rows[1:] == rows[:-1])  # a time that stands twice is a jump
    loads = np.zeros((len(rows), 7))
    loads[:, 0], loads[:, 3] = time[rows], -2000.0 * np.where(second, behind[rows], before[rows])
    posture = [0.0, -0.3, 0.5, 0.0, 0.6, 0.0]
    (tmp_path / "case.toml").write_text(f'robot.torque_curve = "{curve}"\n')
    write_table(tmp_path / "desired.csv", POSE, table[:, :8])
    write_table(tmp_path / "wrench.csv", LOADS, loads)
    still = np.array([[t, *posture] for t in (0.0, 0.3, time[-1])])
    write_table(tmp_path / "command.csv", DRIVES, still)
    assert judged(tmp_path, example_fmu, 0.00025)["max_um"] < 1.0
    answer = judged(tmp_path, example_fmu, 0.001)
    assert answer["max_um"] < 0.01
    assert answer["command"]["max_acceleration_rad_s2"] == [0.0] * 6
    table[:, 2] += 10e-6
    table[137, 1] += 30e-6
    write_table(tmp_path / "desired.csv", POSE, table[:, :8])
    moved = judged(tmp_path, example_fmu, 0.001)
    assert moved["max_um"] == pytest.approx(np.hypot(10.0, 30.0), abs=0.01)
    assert moved["rms_um"] == pytest.approx(np.sqrt(100.0 + 900.0 / len(time)), abs=0.01)
