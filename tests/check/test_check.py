"""elastic-robot check: what is said of a case without running it."""

from __future__ import annotations

import re
from pathlib import Path

import numpy as np
import pytest
from line_case import changed_text
from places import CASES, LINE_CASE

from coupling.case.case import Case
from coupling.case.file import load_case
from coupling.check.clearance import DIRECTIONS, clearance_around
from coupling.check.run_effort import estimate_run, warn_of_memory
from coupling.errors import PlanningError, SimulationError
from coupling.files.csv_table import write_table
from coupling.files.robot_file import find_robot
from coupling.inverse.joint_limits import JointLimits
from coupling.path.controller import Controller
from coupling.path.deviation import Deviation
from coupling.path.histories import ToolPath
from coupling.path.joint_path import JointPath
from coupling.report.blocked_report import blocked_report
from coupling.report.drives import drives_table
from coupling.report.static_scene import links
from coupling.results.replay import Replay
from coupling.results.scene import Scene
from coupling.robot.blocked_path import UnreachableError
from coupling.robot.inverse_kinematics import InverseKinematics
from coupling.run.drive_motion import drive_motions
from coupling.run.gear_loads import planned_joints


@pytest.fixture
def checked(monkeypatch, command):
    """Function that checks a case in its folder; returns exit status and what was said."""

    def check(case: Path, *options: str) -> tuple[int, str]:
        monkeypatch.chdir(case.parent)
        done = command("check", case, "-v", *options)
        return done.returncode, done.stdout + done.stderr

    return check


def short(folder: Path, name: str, **changes: str) -> Path:
    """Return a case of one small contour in a folder of its own."""
    file = folder / f"{name}.toml"
    one = (
        ("depth_m        = 0.01", "depth_m = 0.0005"),
        ("radius_m       = 0.06", "radius_m = 0.03"),
    )
    file.write_text(changed_text(CASES / file.name, *one, *changes.items()))
    return file


def test_it_tells_path_joints_and_gears_and_leaves_nothing(tmp_path, checked):
    case = short(tmp_path, "cone")
    status, said = checked(case, "--evaluate")
    assert status == 0, said
    assert re.search(r"Path: [0-9.]+ m in ", said)
    assert re.search(r"joint 6 .*none .*-", said)
    assert "Possible shift of the whole path [mm]" in said
    assert "evaluations of the process" in said
    assert "backlash reversals" in said
    assert re.search(
        r"backlash \+20 % or backlash -20 % in all gears .* up to [0-9.]+ (um|mm),", said
    )
    assert "hysteresis" not in said
    assert {file.name for file in tmp_path.iterdir()} == {"cone.toml", "cone_check.html"}
    assert "reach, vertical plane" in (tmp_path / "cone_check.html").read_text()


def test_pages_of_cases_of_one_name_lie_beside_their_cases(tmp_path, checked):
    for folder in ("first", "second"):
        (tmp_path / folder).mkdir()
        status, said = checked(short(tmp_path, "cone").rename(tmp_path / folder / "case.toml"))
        assert status == 0, said
    for folder in ("first", "second"):
        # The file's name says nothing: the folder's does.
        assert f"<h1>{folder}: check" in (tmp_path / folder / "case_check.html").read_text()
    assert not (tmp_path / "results").exists()


def test_a_folder_that_takes_no_page_is_said_before_the_work(tmp_path, checked):
    taken = tmp_path / "taken"
    taken.write_text("a file")
    status, said = checked(short(tmp_path, "cone"), "-o", str(taken / "page.html"))
    assert status == 2
    assert "taken is no folder to write into: name another place (--output)" in said


def wrong_gears(said: str) -> list[float]:
    """Return what wrong gears leave, and less a constant, as it is said [um]."""
    (line,) = (line for line in said.splitlines() if "in all gears" in line)
    sizes = re.findall(r"([0-9.]+) (um|mm)", line)
    return [float(size) * (1.0 if unit == "um" else 1e3) for size, unit in sizes]


def test_without_the_process_only_the_robot_s_weight_counts(tmp_path, checked):
    status, said = checked(short(tmp_path, "cone_robust"))
    assert status == 0, said
    assert "under the robot's own weight" in said
    _, forced = checked(short(tmp_path, "cone_robust"), "--evaluate")
    assert "No gear reverses: an error of the backlash causes little but a constant" in forced
    most, rest = wrong_gears(forced)
    assert rest < 0.1 * most


def test_gears_that_turn_without_backlash_are_not_said_to_keep_a_flank(tmp_path, checked):
    """All that is said of their backlash is that there is none."""
    curve = {'torque_curve = "backlash"': 'torque_curve = "linear"'}
    status, said = checked(short(tmp_path, "cone", **curve), "--evaluate")
    assert status == 0, said
    assert "No gear has backlash in this model" in said
    assert "flank" not in said
    assert "simulated" not in said


@pytest.mark.parametrize("known", [True, False])
def test_wrong_slip_torques_are_told_where_gears_have_elements(
    tmp_path, checked, monkeypatch, known
):
    """Apart from a wrong backlash; a robot that cannot be simulated, beside the rest."""
    deviations = {"backlash +20 %": 3e-6, "hysteresis +30 %": 2e-6, "hysteresis -30 %": 1e-6}

    def wrong(*args: object) -> tuple[Replay, ...]:
        if not known:
            raise SimulationError("step 7: no equilibrium")
        return tuple(
            Replay(name=name, deviation=Deviation(size, size, size, size, 0.0, 0.5 * size))
            for name, size in deviations.items()
        )

    monkeypatch.setattr("coupling.check.robot_findings.gear_replays", wrong)
    gear = "gear.hysteresis = [{ slip_torque = 40.0, slip_angle = 2e-5 }]\n"
    text = find_robot("icme2008").read_text()
    (tmp_path / "robot.toml").write_text(text.replace("backlash  =", f"{gear}backlash  =", 1))
    status, said = checked(short(tmp_path, "cone", **{'"icme2008"': '"robot.toml"'}), "--evaluate")
    assert status == 0, said
    said = " ".join(said.split())
    assert "backlash reversals" in said
    if known:
        told = "in all gears the deviation under the exact command is up to"
        assert f"With backlash +20 % {told} 3.00 um, 1.50 um less a constant" in said
        assert (
            f"With hysteresis +30 % or hysteresis -30 % {told} 2.00 um, 1.00 um less a constant"
            in said
        )
    else:
        for what in ("backlash", "hysteresis"):
            unknown = f"The effect of an error of the {what} is not known: step 7: no equilibrium"
            assert unknown in said


def test_noise_of_a_measured_force_is_told_and_moves_no_gear(tmp_path, checked):
    """The record of the cone's force with 15 N of noise: as it comes it would move the tool further."""
    cone = load_case(short(tmp_path, "cone"))
    force = cone.process.evaluate(cone.desired).wrench
    noise = np.random.default_rng(1).normal(0.0, 15.0, force.force[0].shape)
    rows = np.column_stack([force.time, force.force[0] + noise])
    write_table(tmp_path / "record.csv", ("time", "fx", "fy", "fz"), rows)
    text = (tmp_path / "cone.toml").read_text()
    head, tail = text.index("[process]"), text.index("[coupling]")
    found = {}
    for cutoff in ("", 'cutoff_Hz = "none"\n'):
        keys = 'model = "measured"\nfile = "record.csv"\nframe = "base"\n'
        file = tmp_path / "measured.toml"
        file.write_text(f"{text[:head]}[process]\n{keys}{cutoff}\n{text[tail:]}")
        status, said = checked(file, "--evaluate")
        assert status == 0, said
        assert "The forces of the process have noise of about 1" in said
        found[cutoff] = wrong_gears(said)
    quiet, loud = found.values()
    assert loud[1] > 1.2 * quiet[1]


def test_what_cannot_be_read_is_said_in_a_sentence(tmp_path, checked):
    case = short(tmp_path, "cone")
    case.write_bytes(b"\xff\xfe[robot")
    status, said = checked(case)
    assert status == 2
    assert "Traceback" not in said


OUTWARD = (
    ("[1.6, 0.1, 0.8]", "[2.0, 0.1, 0.8]"),
    ("[[0.0, 0.0, 0.002], [0.0, 0.0, -0.002], [0.06, 0.0, -0.002], [0.06, 0.0, 0.002]]", "{0}"),
)


def outward_case(folder: Path, robot: str = "icme2008") -> Path:
    """Return a case whose line leads 1.5 m away from the robot, and out of its reach."""
    text = changed_text(LINE_CASE, *OUTWARD).format("[[0.0, 0.0, 0.0], [1.5, 0.0, 0.0]]")
    file = folder / "outward.toml"
    file.write_text(text.replace("icme2008", robot))
    return file


def test_a_path_out_of_reach_has_a_page_that_shows_where_the_robot_stops(tmp_path, checked):
    """The piece that it follows, and the way that the tool does not come, are in the picture."""
    case = outward_case(tmp_path)
    status, said = checked(case)
    assert status == 2
    assert "Traceback" not in said
    followed = float(re.search(r"Followed: (\d+) % of the path", said)[1])
    assert 5.0 < followed < 95.0
    assert "the tool does not come to its place" in said
    assert "elastic-robot place" in said
    page = (tmp_path / "outward_check.html").read_text()
    for line in ("path that it follows", "path that it does not follow", "missing to its place"):
        assert line in page
    case = load_case(case)
    (scene, error) = blocked_scene(case)
    (robot,) = scene.robots
    lines = {line.name: line.points for line in scene.lines}
    way = np.linalg.norm(np.diff(case.desired.position[0], axis=0), axis=1)
    share = np.linalg.norm(np.diff(lines["path that it follows"], axis=0), axis=1).sum() / way.sum()
    assert share == pytest.approx(0.01 * followed, abs=0.006)
    tool, place = lines["missing to its place"]
    np.testing.assert_allclose(links(robot, robot.motion.q[0])[-1], tool, atol=1e-9)
    np.testing.assert_allclose(place, case.desired.position[0][error.blocked.row], atol=1e-9)


def test_a_part_that_cannot_be_touched_off_has_a_page_as_a_path_out_of_reach_has(
    tmp_path, checked, command
):
    """The line is within reach, the second of three points to touch is 2 m away from it."""
    text = changed_text(
        LINE_CASE,
        (
            "rpy_deg    = [0.0, 0.0, 30.0]",
            """rpy_deg    = [0.0, 0.0, 30.0]
touch_off  = [[0.0, 0.0, 0.0], [2.0, 0.0, 0.0], [0.0, 0.1, 0.0]]""",
        ),
    )
    case = tmp_path / "far.toml"
    case.write_text(text)
    status, said = checked(case)
    assert status == 2
    assert "Traceback" not in said
    assert (
        "The robot cannot touch the part off: at point 2 the tool does not come to its place"
        in said
    )
    assert "touch_off = [[x, y, z], ..] in [part]" in said
    page = (tmp_path / "far_check.html").read_text()
    for line in ("path on the part", "missing to its place", "reach, vertical plane"):
        assert line in page
    assert "path that it does not follow" not in page
    done = command("couple", case, "-o", tmp_path / "out", exits=2)
    assert f"elastic-robot check {case}" in " ".join(done.stderr.split())


def blocked_scene(case: Case) -> tuple[Scene, UnreachableError]:
    with pytest.raises(UnreachableError) as caught:
        planned_joints(case.robots, case.desired)
    scene = blocked_report(case, caught.value, Path("outward.toml")).first_screen.scene
    assert scene is not None
    return scene, caught.value


def test_a_joint_beyond_its_limit_is_named_and_its_axis_is_drawn(tmp_path, checked):
    first = "origin    = [0.0, 0.0, 0.0]"
    text = find_robot("icme2008").read_text()
    (tmp_path / "short.toml").write_text(text.replace(first, f"{first}\nlimits = [-1.0, 0.2]", 1))
    case = outward_case(tmp_path, "short.toml")
    text = case.read_text().replace("[1.5, 0.0, 0.0]", "[0.0, 0.9, 0.0]")
    case.write_text(text.replace("30.0]", "0.0]"))
    status, said = checked(case)
    assert status == 2
    assert "joint 1 passes its limit" in said
    beyond = np.rad2deg(np.arctan2(1.0, 2.0) - 0.2)
    assert float(re.search(r"Joint 1 beyond its limit: ([0-9.]+) deg", said)[1]) == pytest.approx(
        beyond, abs=0.05
    )
    assert "home_deg in [robot]" in said
    scene, error = blocked_scene(load_case(case))
    (axis,) = (line.points for line in scene.lines if line.name == "axis of joint 1")
    np.testing.assert_allclose(np.cross(axis[1] - axis[0], [0.0, 0.0, 1.0]), 0.0, atol=1e-12)
    row = error.blocked.row
    angles = error.blocked.angles[:, 0]
    assert angles[row - 1] <= 0.2 < angles[row]


@pytest.mark.parametrize("kind", ["couple", "compensate"])
def test_a_run_out_of_reach_names_the_command_that_shows_where(tmp_path, command, kind):
    case = outward_case(tmp_path)
    done = command(kind, case, "-o", tmp_path / "out", exits=2)
    assert f"elastic-robot check {case}" in " ".join(done.stderr.split())


def test_the_whole_path_can_be_moved_as_far_as_is_told_and_no_farther():
    """Its outermost places are led there by inverse kinematics of poses; farther one of them is not."""
    case = load_case(CASES / "gcode_groove.toml")
    placed, path = case.robots[0], case.desired.at_rows(np.arange(0, len(case.desired.time), 10))
    planner = InverseKinematics(placed.description, placed.home)
    angles = planner.plan(path).q[0]
    room = clearance_around(placed.description, path, angles)
    position = path.position[0]
    outermost = {*position.argmin(axis=0).tolist(), *position.argmax(axis=0).tolist()}
    for name in ("+x", "-z"):
        way = room.free[name]
        assert 0.1 < way < 3.0
        for length, all_come in ((way, True), (way + 0.03, False)):
            # Densely at the end, so that no sample steps across a singular posture.
            ways = np.append(
                np.linspace(0.0, length - 0.06, 60), np.linspace(length - 0.059, length, 120)
            )
            line = ways[:, None] * np.array(DIRECTIONS[name])
            came = [
                _is_led(placed.description, angles[k], ToolPath(np.arange(180.0), poses))
                for k in outermost
                for poses in [
                    np.hstack([position[k] + line, np.tile(path.pose[0, k, 3:], (180, 1))])
                ]
            ]
            assert all(came) is all_come
    reach = np.linalg.norm(np.diff(room.links, axis=0), axis=1).sum()
    assert np.linalg.norm(room.vertical, axis=1).max() < reach
    assert np.ptp(room.horizontal[:, 2]) < 1e-9 < 1.0 < np.ptp(room.vertical[:, 2])
    assert np.linalg.norm(room.links[-1] - position[0]) < 1e-8


def _is_led(robot, home, line):
    try:
        InverseKinematics(robot, home).plan(line)
    except PlanningError:
        return False
    return True


def test_joints_beyond_their_limits_are_named():
    time = np.linspace(0.0, 1.0, 101)
    swing = (0.5 - 0.5 * np.cos(2.0 * np.pi * time))[:, None]
    limits = JointLimits(*np.array([[-1.0], [0.9], [3.0], [19.0]]))
    (asked,) = drive_motions(JointPath(time, (swing,)), limits)
    assert asked.margin == pytest.approx(-0.1, abs=1e-9)
    assert asked.exceeded == ["angle", "rate", "acceleration"]
    assert drives_table([asked]).rows[0][-1] == "angle, rate, acceleration"


def test_a_process_of_unknown_cost_is_not_evaluated_and_said_to_be_unknown(tmp_path, checked):
    (tmp_path / "run.py").write_text("raise SystemExit('was run')")
    text = (CASES / "external_template.toml").read_text()
    case = tmp_path / "case.toml"
    case.write_text(text.replace("{case}/../process_template.py", "{case}/run.py"))
    status, said = checked(case)
    assert status == 0, said
    assert "of unknown duration" in said


def test_the_time_of_rows_that_may_miss_the_path_holds_their_simulations():
    """A path of 3.7 s on rows of 12 ms took 210 simulations in 17 s for one inverse of three."""
    time = np.linspace(0.0, 3.7, 186)
    path = ToolPath(time, np.tile([1.6, 0.0, 0.8, 0.0, 0.0, 0.0, 1.0], (len(time), 1)))
    close, far = (estimate_run(path, Controller(cycle=own), 3, None) for own in (0.004, 0.012))
    seconds = [tuple(map(float, re.findall(r"\d+", own)[:2])) for own in (close, far)]
    assert seconds[0][0] == seconds[1][0]
    assert seconds[1][1] > seconds[0][1] + 3 * 17.0
    assert "rows every 12 ms" in far
    assert close.endswith("memory: about 0.3 GB")
    hour = np.arange(0.0, 3600.0, 0.004)
    long = ToolPath(hour, np.tile(path.pose[0, 0], (len(hour), 1)))
    assert estimate_run(long, Controller(cycle=0.004), 3, None).endswith("memory: about 4.8 GB")
    assert warn_of_memory(path) == ""
    assert (
        "3600 s has 900000 rows: this check and a compensation take about 5 GB"
        in warn_of_memory(long)
    )
    assert "simulations" not in close
