"""Commands of the method "inverse" replayed by the judge, a program without its code; and the judge."""

import json
from pathlib import Path

import numpy as np
import pytest
from conftest import reference
from line_case import changed_text
from places import CASES, EXAMPLES

from coupling.files.csv_table import write_table
from coupling.files.robot_file import find_robot, load_robot
from coupling.fmu_export.build import BuildOptions, build_fmu

KUKA = str(EXAMPLES / "robots" / "kuka_kr210.toml")
ROWS_AT_WILL = {"cycle_s       = 0.004": "cycle_s = 0.001"}
SHORT_CONE = {
    "depth_m        = 0.01": "depth_m = 0.001",
    "radius_m       = 0.06": "radius_m = 0.01",
}
FAST_ISO = {"size_m   = 0.4": "size_m = 0.14\nsample_s = 0.004", "feed_m_s = 0.1": "feed_m_s = 0.5"}
SHORT_SLOT = {"[0.06, ": "[0.03, ", "[0.14, ": "[0.05, ", "[0.2, ": "[0.08, "}
HELD_BACK = '[controller]\nmax_acceleration_rad_s2 = 15.0\ninterpolation = "cubic"\n'


def edited(name: str, changes: dict[str, str], tail: str = "") -> str:
    return changed_text(CASES / f"{name}.toml", *changes.items()) + tail


@pytest.mark.parametrize(
    ("case", "robot", "largest", "rms"),
    [
        (edited("cone", SHORT_CONE | ROWS_AT_WILL), "icme2008", 3.0, 0.5),
        (edited("cone", SHORT_CONE), "icme2008", 10.0, 1.0),
        (edited("iso9283", FAST_ISO), "icme2008", 3.0, 0.7),
        (edited("iso9283", FAST_ISO, HELD_BACK), "icme2008", 10.0, 2.0),
        (edited("milling_20000", SHORT_SLOT), "icme2008", 2.0, 0.5),
        (edited("cone", SHORT_CONE | {'"icme2008" ': f'"{KUKA}" '}), KUKA, 3.0, 0.5),
    ],
    ids=["cone, 1 kHz", "cone", "fast", "fast, held back", "milling", "cone of another robot"],
)
def test_the_judge_finds_the_moving_tool_on_its_path(
    command, judged, monkeypatch, tmp_path, case, robot, largest, rms
):
    """Dynamic native FMU at a tolerance of 1e-8, every 4 ms; largest and rms deviation in um.

    The pages, a fifth of the work, are looked at elsewhere.
    """
    monkeypatch.setattr(
        "coupling.report.result_report.ResultReport.write", lambda report, place: None
    )
    (tmp_path / "case.toml").write_text(case)
    command("compensate", "-v", tmp_path / "case.toml", "-o", tmp_path / "run", exits=0)
    figures = json.loads((tmp_path / "run" / "result.json").read_text())
    # On the desired path once; under the command once, but that a window of a cut takes up to three.
    assert figures["process_evaluations"] in (range(2, 5) if "milling-force" in case else [2])
    description = load_robot(find_robot(robot, Path()))
    fmu = build_fmu(description, tmp_path / "R.fmu", BuildOptions("native"))
    found = judged(tmp_path / "run", fmu)
    assert found["max_um"] < largest
    assert found["rms_um"] < rms
    # What the run says of itself is what the judge finds.
    assert found["max_um"] == pytest.approx(1e6 * figures["deviation_after_m"]["maximum"], abs=0.02)
    # What the teeth leave is told apart from what is slower, and neither is more than all of it.
    tooth_passing = figures["tooth_passing"]
    assert (tooth_passing is not None) == ("milling-force" in case)
    if tooth_passing is not None:
        assert tooth_passing["period_s"] == pytest.approx(60.0 / 20_000 / 2)
        largest = figures["deviation_after_m"]["maximum"]
        assert (
            max(tooth_passing["slow_m"], tooth_passing["ripple_m"])
            <= 1.01 * largest
            <= 1.03 * (tooth_passing["slow_m"] + tooth_passing["ripple_m"])
        )


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
