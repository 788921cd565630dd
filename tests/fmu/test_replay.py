"""The judge of run folders (tests/helpers/replay.py) against solutions made with other engines."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from conftest import reference
from scipy.spatial.transform import Rotation

from coupling.fmu_export.build import BuildOptions, build_fmu

CURVES = {"linear": "nobacklash", "backlash": "backlash"}
POSE = ("time", "x", "y", "z", "qx", "qy", "qz", "qw")
LOADS = ("time", "fx", "fy", "fz", "mx", "my", "mz")
POSTURE = [0.0, -0.3, 0.5, 0.0, 0.6, 0.0]


@pytest.fixture(scope="session")
def fmu(example, tmp_path_factory) -> Path:
    return build_fmu(example, tmp_path_factory.mktemp("judge") / "R.fmu", BuildOptions("native"))


def write(folder: Path, name: str, columns: tuple[str, ...], rows: np.ndarray) -> None:
    folder.mkdir(exist_ok=True)
    header = ",".join(columns)
    np.savetxt(folder / f"{name}.csv", rows, delimiter=",", header=header, comments="", fmt="%.17g")


def write_step(folder: Path, curve: str, base: tuple[np.ndarray, Rotation] | None = None) -> None:
    """A robot that stands under -2000 N on 0.1 <= t < 0.3 s; `base`: its place in the files' frame."""
    table = reference(f"c_step_{CURVES[curve]}")
    position, rotation = base or (np.zeros(3), Rotation.identity())
    time = table[:, 0]
    before, behind = (time > 0.1005) & (time < 0.3005), (time > 0.0995) & (time < 0.2995)
    rows = np.sort(np.append(np.arange(len(time)), np.flatnonzero(before != behind)))
    second = np.append(False, rows[1:] == rows[:-1])  # a time that stands twice is a jump
    loads = np.zeros((len(rows), 6))
    loads[:, 2] = -2000.0 * np.where(second, behind[rows], before[rows])
    turned = (rotation * Rotation.from_quat(table[:, 4:8])).as_quat()
    pose = np.hstack([time[:, None], position + rotation.apply(table[:, 1:4]), turned])
    forces = rotation.apply(loads.reshape(-1, 3)).reshape(-1, 6)
    write(folder, "desired", POSE, pose)
    write(folder, "wrench", LOADS, np.column_stack([time[rows], forces]))
    drives = np.array([[t, *POSTURE] for t in (0.0, 0.3, time[-1])])
    write(folder, "command", ("time", *(f"q{i + 1}" for i in range(6))), drives)


@pytest.mark.parametrize("curve", CURVES)
def test_a_standing_robot_under_a_force_that_steps(judged, fmu, tmp_path, curve):
    """The path desired is the reference's, exact to 3e-14 m: what is left is the tolerance.

    Between its samples it is a cubic spline, to which a force that steps is a kink.
    """
    write_step(tmp_path, curve)
    answer = judged(tmp_path, fmu, "--curve", curve, "--every", 0.00025)
    assert answer["max_um"] < 1.0
    answer = judged(tmp_path, fmu, "--curve", curve, "--every", 0.001)
    assert answer["max_um"] < 0.01
    assert answer["max_angle_urad"] < 0.01
    assert answer["command"]["max_acceleration_rad_s2"] == [0.0] * 6


def test_a_path_that_is_moved_aside_is_missed_by_as_much(judged, fmu, tmp_path):
    write_step(tmp_path, "linear")
    rows = np.loadtxt(tmp_path / "desired.csv", delimiter=",", skiprows=1)
    rows[:, 2] += 10e-6
    rows[137, 1] += 30e-6
    write(tmp_path, "desired", POSE, rows)
    answer = judged(tmp_path, fmu, "--curve", "linear", "--every", 0.001)
    assert answer["max_um"] == pytest.approx(np.hypot(10.0, 30.0), abs=1e-3)
    assert answer["time_of_max_s"] == pytest.approx(rows[137, 0])
    assert answer["rms_um"] == pytest.approx(np.sqrt(100.0 + 900.0 / len(rows)), abs=1e-3)


def test_robots_of_a_cell_stand_in_one_frame(judged, fmu, tmp_path):
    """The support is the same robot somewhere else; the gap is missed by what the tools miss it by."""
    at, rpy = np.array([3.8, 0.2, -0.1]), [10.0, -20.0, 170.0]
    base = at, Rotation.from_euler("xyz", rpy, degrees=True)
    (tmp_path / "case.toml").write_text(
        f"""robot.torque_curve = "backlash"
process.tool_diameter_m = 0.01
[support]
torque_curve = "linear"
tool_diameter_m = 0.012
base_position_m = {at.tolist()}
base_rpy_deg = {rpy}
"""
    )
    write_step(tmp_path / "forming", "backlash")
    write_step(tmp_path / "support", "linear", base)
    answer = judged(tmp_path, fmu, "--every", 0.001)
    assert max(answer[name]["max_um"] for name in ("forming", "support", "gap")) < 0.01
    desired = {
        name: np.loadtxt(tmp_path / name / "desired.csv", delimiter=",", skiprows=1)
        for name in ("forming", "support")
    }
    line = desired["support"][0, 1:4] - desired["forming"][0, 1:4]
    desired["forming"][:, 1:4] += 10e-6 * line / np.linalg.norm(line)
    write(tmp_path / "forming", "desired", POSE, desired["forming"])
    assert judged(tmp_path, fmu, "--every", 0.001)["gap"]["max_um"] == pytest.approx(10.0, rel=1e-3)


def test_parameters_are_set_by_name_and_scaled_by_kind(judged, fmu, tmp_path):
    """Without weight a constant force bends the robot, a thousandth as much where it is stiffer."""
    posture, pose = reference("poses")[0, 1:], reference("a_fk")[0, 1:8]
    time = np.array([0.0, 0.01, 0.02, 0.03])
    forces = np.tile([0.0, 100.0, -200.0, 300.0, 0.0, 0.0, 0.0], (4, 1))
    still = {"desired": (POSE, pose), "wrench": (LOADS, forces[0, 1:])}
    still["command"] = ("time", *(f"q{i + 1}" for i in range(6))), posture
    for name, (columns, values) in still.items():
        write(tmp_path, name, columns, np.column_stack([time, np.tile(values, (4, 1))]))

    def bent(**scale: float) -> float:
        factors = ",".join(f"{name}={factor}" for name, factor in scale.items())
        options = "--curve", "linear", "--set", "gravity.z=0", "--scale", factors
        return judged(tmp_path, fmu, *options)["max_um"]

    assert bent(wrench=1.0) > 50.0
    assert bent(wrench=0.0) < 1e-3
    assert bent(stiffness=1e3) == pytest.approx(1e-3 * bent(stiffness=1.0), rel=1e-2)
