"""Whole commands for robots of seven axes, rigid robots, and those of more axes than an FMU holds."""

from pathlib import Path

import numpy as np
import pytest
from command_line import command

from coupling.case.file import load_case
from coupling.native.robot_text import MOST_JOINTS
from coupling.place.placing import placing
from coupling.place.settings import NAMES
from coupling.robot.inverse_kinematics import InverseKinematics

CASE = """
[robot]
description = "robot.toml"
mode = "dynamic"
home_deg = {home}
[part]
position_m = {position}
[tool_path]
kind = "line"
points_m = [[0.0, 0.0, 0.002], [0.0, 0.0, -0.002], [0.03, 0.0, -0.002], [0.03, 0.0, 0.002]]
feed_m_s = 0.1
blend_s = 0.1
sample_s = 0.01
[process]
model = "elastic-wall"
stiffness_N_m = 2.0e4
[compensation]
method = "inverse"
tolerance_m = 1e-5
[controller]
cycle_s = 0.004
interpolation = "quintic"
[place]
settings = 200
cases = 1
{place}
"""
JOINT = """
[[joint]]
origin = [0.0, 0.0, 0.2]
axis = {axis}
mass = 4.0
com = [0.0, 0.0, 0.05]
inertia = [0.02, 0.02, 0.01]
limits = [-2.8, 2.8]
{more}
"""
ELASTIC = "stiffness = 1.0e5\ndamping = 100.0"
TILT = "tilt = [{axis = [1, 0, 0], stiffness = 5e5, damping = 500.0}]"


def written(folder: Path, more: list[str], place: str = "") -> Path:
    """Write a case with an arm whose joints turn about z and y in turn, `more` of each; return it."""
    turns = {6: "zyyzyz"}.get(len(more), "zy" * len(more))
    text = 'name = "arm"\n[tcp]\nposition = [0, 0, 0.15]\nrpy = [0.0, -1.5707963267948966, 0.0]\n'
    for turn, own in zip(turns, more, strict=False):
        axis = {"z": "[0, 0, 1]", "y": "[0, 1, 0]"}[turn]
        text += JOINT.format(axis=axis, more=own)
    (folder / "robot.toml").write_text(text)
    home = {6: [0, 30, 80, 0, 70, 0], 7: [10, 50, -10, 80, 5, 50, 5]}.get(
        len(more), [20] * len(more)
    )
    case = folder / "case.toml"
    case.write_text(
        CASE.format(home=[float(a) for a in home], position=[0.5, 0.0, 0.2], place=place)
    )
    return case


def test_a_robot_of_seven_axes_is_compensated_to_a_few_micrometres_and_replays_so(tmp_path, judged):
    """The command as written, through the FMU, by the judge that shares no code with the project."""
    case = written(tmp_path, [ELASTIC] * 7)
    command("compensate", "-v", case, "-o", tmp_path / "run", "--no-store", exits=0)
    fmu = tmp_path / "arm.fmu"
    command(
        "build", "--robot", tmp_path / "robot.toml", "-o", fmu, "--platforms", "linux64", exits=0
    )
    figures = judged(tmp_path / "run", fmu)
    assert figures["max_um"] < 3.0
    command("export", tmp_path / "run", "--to", "csv", "-o", tmp_path / "csv", exits=0)


def test_place_looks_at_the_postures_that_a_placed_case_is_planned_in(tmp_path):
    """Home moves with the setting "elbow": screen and plan take the same joint angles."""
    loaded = load_case(written(tmp_path, [ELASTIC] * 7))
    task = placing(loaded, loaded.process, "stiffness")
    assert "elbow" in {NAMES[k] for k in task.ranges.free}
    settings = np.tile(task.present, (3, 1))
    settings[:, NAMES.index("elbow")] = [0.0, 0.6, -0.6]
    q = task.screen(task.stations).batch(settings).q
    for k, home in enumerate(task.arm.homes(settings).T):
        planned = InverseKinematics(task.robot, home).plan(loaded.desired).q[0]
        np.testing.assert_allclose(q[:, :, k], planned, atol=1e-5)
    assert np.abs(q[0, :, 1] - q[0, :, 2]).max() > 0.3


def test_a_robot_without_elastic_joints_is_rigid_and_says_so(tmp_path):
    case = written(tmp_path, [""] * 6)
    for words in (
        ("check", case, "-v", "-o", tmp_path / "c.html"),
        ("couple", case, "-v", "-o", tmp_path / "a", "--no-store"),
        ("compensate", case, "-v", "-o", tmp_path / "b", "--no-store"),
    ):
        done = command(*words, exits=0)
        assert "no joint is elastic, so that its deviation is zero" in " ".join(done.stdout.split())
    assert "Expected deviation on a real robot" not in done.stdout
    refused = command("place", case, "-o", tmp_path / "p", exits=2)
    assert "add stiffness and damping under [[joint]]" in " ".join(refused.stderr.split())


def test_what_a_program_leaves_out_is_in_the_report_of_its_run_once(tmp_path):
    case = written(tmp_path, [""] * 6)
    head, rest = case.read_text().split("[tool_path]\n")
    case.write_text(
        f'{head}[tool_path]\nkind = "gcode"\nfile = "part.nc"\n[process]{rest.split("[process]")[1]}'
    )
    (tmp_path / "part.nc").write_text(
        "G21 G90 G54\nG0 X0. Y0. Z2.\nG1 Z-2. F900 M8\nX3.\nY1\nG0 Z2."
    )
    done = command("couple", "-v", case, "-o", tmp_path / "run", "--no-store", exits=0)
    page = (tmp_path / "run" / "report.html").read_text()
    for said in ("part.nc: read and left out: G54, M8", "part.nc: line 5: Y1 is a whole number"):
        assert " ".join(done.stdout.split()).count(said) == 1
        assert page.count(said) == 1


@pytest.mark.parametrize("more", [["", TILT, "", "", TILT, ""], ["", "", ELASTIC, "", "", ""]])
def test_robots_that_give_way_in_some_joints_or_tilts_alone_run_all_commands(tmp_path, more):
    case = written(tmp_path, more)
    for words in (
        ("check", case, "-v", "-o", tmp_path / "c.html"),
        ("compensate", case, "-v", "-o", tmp_path / "b", "--no-store"),
    ):
        command(*words, exits=0)
    loaded = load_case(case)
    task = placing(loaded, loaded.process, "stiffness")
    figures = task.screen(task.stations).figures(task.present[None])
    assert figures.reached.all()
    assert figures.compliance[0] > 0.0


def test_more_joints_than_the_native_fmu_holds_are_refused_where_a_case_is_read(tmp_path):
    case = written(tmp_path, [ELASTIC] * (MOST_JOINTS + 1))
    done = command("check", "-v", case, exits=2)
    said = " ".join(done.stderr.split())
    assert f"expected at most {MOST_JOINTS} joints for a native FMU, got {MOST_JOINTS + 1}" in said
    assert "case.toml: robot: description" in said


def test_the_elbow_is_refused_of_a_robot_of_six_axes(tmp_path):
    case = written(tmp_path, [ELASTIC] * 6, "elbow_deg = [-10.0, 10.0]")
    done = command("place", case, "-o", tmp_path / "p", exits=2)
    assert "elbow_deg: expected it for a robot of more than 6 joints" in " ".join(
        done.stderr.split()
    )
