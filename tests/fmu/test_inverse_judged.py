"""Commands of the method "inverse", as written, replayed by the judge: a program without its code."""

from __future__ import annotations

import json
from pathlib import Path

import pytest
from line_case import changed_text
from places import CASES, EXAMPLES

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
    done = command("compensate", "-v", tmp_path / "case.toml", "-o", tmp_path / "run")
    assert done.returncode == 0, done.stdout + done.stderr
    figures = json.loads((tmp_path / "run" / "result.json").read_text())
    # On the desired path once; under the command once, but that a window of a cut takes up to three.
    assert figures["process_evaluations"] == (4 if "milling-force" in case else 2)
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
