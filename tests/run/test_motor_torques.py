"""What commands and paths ask of motors: torques beside their limits, in run, report, check."""

import json
import re
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from command_line import command
from line_case import line_case, moving_line
from motor_file import with_motors

from coupling.case.case import Case
from coupling.case.file import load_case
from coupling.check.robot_findings import examine_robots
from coupling.errors import PlanningError, SimulationError
from coupling.fmu_export.build import BuildOptions, build_fmu
from coupling.inverse.diagnosis import gear_loads
from coupling.inverse.inversion import MovingRobot
from coupling.path.controller import Controller
from coupling.path.frame import AT_THE_ORIGIN
from coupling.path.histories import ToolPath, WrenchHistory
from coupling.path.interpolation import SampledPath
from coupling.path.joint_path import JointPath, MotorHistory
from coupling.process import ProcessResponse
from coupling.report.drives import drives
from coupling.report.run_report import run_report
from coupling.robot.cell import Cell, Member
from coupling.robot.robot_fmu import RobotFmu
from coupling.run.drive_motion import DRIVE_MOTION
from coupling.run.execute import run_compensation, run_coupling
from coupling.run.gear_loads import wanted_of
from coupling.run.predicted_motor_torques import COLD, WARM, explained_by_motors
from coupling.run.simulated_motor_torques import MOTOR_TORQUES, summarise_motor
from coupling.run.stored_run import read_run
from coupling.store import EvaluatedProcess
from elastic_robot.drive import Drive

FRICTION = 20.0


def line(folder: Path, limit: float | None = None, keys: str = "", *changes) -> Path:
    with_motors(
        folder, more="" if limit is None else f"max_torque_Nm = {limit},", friction=FRICTION
    )
    file = folder / "line.toml"
    file.write_text(moving_line(('"icme2008"', f'"servo.toml"\n{keys}'), *changes))
    return file


def told(case: Case, joints, wrench, folder: Path, drive: str) -> dict[int, tuple[float, ...]]:
    """Largest torque of each motor and its time, of an FMU without limits, set by hand, every 1 ms."""
    robot = case.robots[0].description
    strong = [
        replace(joint, drive=joint.drive and replace(joint.drive, torque_limit=None))
        for joint in robot.joints
    ]
    file = build_fmu(
        replace(robot, joints=tuple(strong)), folder / "own.fmu", BuildOptions("native")
    )
    end = wrench.time[-1]
    time = np.linspace(0.0, end, round(end / 1e-3) + 1)
    with RobotFmu(file, "backlash", drive=drive) as fmu:
        _, found = fmu.with_motors(joints, wrench.refined(time), range(5))
    torque = np.abs(found.torque)
    return {
        i + 1: (torque[:, i].max(), time[torque[:, i].argmax()], found.angle[:, i])
        for i in range(5)
    }


@pytest.fixture(scope="module")
def finished(tmp_path_factory):
    """Case, run folder and what the terminal said."""
    folder = tmp_path_factory.mktemp("motors")
    done = command("compensate", "-v", line(folder, 12000.0), "-o", folder / "out", exits=0)
    return load_case(folder / "line.toml"), folder / "out", done.stdout


def test_torques_of_the_command_are_those_of_the_robots_own_fmu(finished, tmp_path):
    """In result.json, motors.csv, terminal and report; 8 of 12 kN m are asked of the second joint."""
    case, folder, said = finished
    stored = read_run(folder).first
    found = told(case, stored.joints, stored.wrench, tmp_path, "servo")
    time, torque = stored.motor_torque
    page = (folder / "report.html").read_text(encoding="utf-8")
    for drive in json.loads((folder / "result.json").read_text())["command"]["drives"][:5]:
        most, at, _ = found[drive["joint"]]
        # The largest is between the rows of either, at a gear that comes to its flank.
        assert drive["motor_torque_Nm"] == pytest.approx(most, rel=2e-2)
        assert drive["motor_torque_time_s"] == pytest.approx(at, abs=2e-3)
        most, at = drive["motor_torque_Nm"], drive["motor_torque_time_s"]
        assert drive["motor_torque_limit_Nm"] == 12000.0
        assert 0.8 * most < np.abs(torque[drive["joint"] - 1]).max() <= most
        row = rf"joint {drive['joint']} +{most:.4g} +1.2e\+04 +{most / 120.0:.0f} % +{at:.3f} "
        assert re.search(row, said)
        assert f"<td>{most:.4g}</td>" in page
    assert np.array_equal(time, stored.wrench.instants)
    assert "its motor needs" not in said
    axes = [trace.yaxis for trace in drives(stored).data]
    assert axes.count("y4") >= 5


def test_a_motor_without_motion_carries_its_gear(finished):
    """At the start the servo holds what the links weigh: the torque of the gear alone."""
    case, folder, _ = finished
    stored = read_run(folder).first
    _, torque = stored.motor_torque
    (wanted,) = wanted_of(case.robots, case.desired, WrenchHistory.none(case.desired.time))
    static = gear_loads(MovingRobot(case.robots[0].description, "backlash"), wanted).static[0]
    held = np.array([torque[joint][0] for joint in range(5)])
    np.testing.assert_allclose(held, -static, rtol=2e-3, atol=1.0)
    assert np.abs(static).max() > 5000.0


def test_reversals_of_a_motor_and_what_its_friction_sticks_have_closed_forms():
    """A sine of amplitude A turns twice a period; behind each it sticks over 2 a: acos(1 - 2 a / A)."""
    a, amplitude, periods = 1e-4, 1e-2, 5
    time = np.linspace(0.0, periods, 200_001)
    angle = amplitude * np.sin(2.0 * np.pi * time)
    motion = MotorHistory((0,), time, *[angle[:, None]] * 3)
    drive = Drive(1.0, position_gain=20.0, rate_gain=100.0, friction=5.0, slip_angle=a)
    found = summarise_motor(drive, motion)
    assert found.motor_reversals == 2 * periods
    first = np.arcsin(a / amplitude)
    sticks = first + 2 * periods * np.arccos(1.0 - 2.0 * a / amplitude)
    assert found.motor_presliding_share == pytest.approx(sticks / (2.0 * np.pi * periods), rel=1e-3)
    assert found.motor_torque_Nm == pytest.approx(amplitude, rel=1e-9)


@pytest.mark.parametrize("mode", ["dynamic", "quasistatic"])
@pytest.mark.parametrize("method", ["inverse", "mirror"])
def test_a_path_that_asks_for_more_than_a_motor_has_is_refused(tmp_path, mode, method):
    """Which joint, when, how much more; no result, as for other demands that cannot be met."""
    changes = [('"dynamic"', f'"{mode}"'), ('"inverse"', f'"{method}"')]
    done = command("compensate", "-v", line(tmp_path, 5000.0, "", *changes), "-o", tmp_path / "out")
    said = " ".join((done.stdout + done.stderr).split())
    assert re.search(
        r"joint 2: its motor needs \S+ N m at t = \d\.\d+ s; its torque limit is 5000 N m, \S+ N m"
        r" less, at rest and without any process: the robot would fall",
        said,
    )
    assert done.returncode == 2
    assert not (tmp_path / "out" / "result.json").exists()
    assert "Converged" not in said


@pytest.mark.parametrize("force", [0.0, 4000.0])
def test_a_robot_that_cannot_be_simulated_under_its_process_is_told_which_motor_is_too_weak(
    tmp_path, force
):
    """8 of 12 kN m hold the weight; 4 kN at 1.7 m from the joint are too much; else the reason stays."""
    case = load_case(line(tmp_path, 12000.0))

    class Pressing:
        identity = ""

        def evaluate(self, path: ToolPath) -> ProcessResponse:
            load = np.zeros((1, len(path.time), 6))
            load[:, :, 2] = -force
            return ProcessResponse(WrenchHistory(path.time, load))

    asked, failed = EvaluatedProcess(Pressing()), SimulationError("needs steps below 2e-11 s")
    asked.evaluate(case.desired)
    with (
        pytest.raises((PlanningError, SimulationError)) as error,
        explained_by_motors(case, asked),
    ):
        raise failed
    if not force:
        assert error.value is failed
        return
    said = re.fullmatch(
        r"joint 2: its motor needs (\S+) N m at t = \S+ s; its torque limit is 12000 N m, \S+ N m"
        r" less, under the process: slow down the path, or expect the robot to fall",
        str(error.value),
    )
    assert 12000.0 < float(said[1]) < 8000.0 + 1.2 * 1.7 * force


def test_a_command_for_ideal_drives_beyond_a_motor_has_not_converged(tmp_path):
    """Its simulation has no motors: it says which joint, when and how much, and exits with 1."""
    file = line(tmp_path, 5000.0, 'drive = "ideal"')
    done = command("compensate", "-v", file, "-o", tmp_path / "out", exits=1)
    figures = json.loads((tmp_path / "out" / "result.json").read_text())
    assert figures["outcome"] == "robot failed"
    asked = [d for d in figures["command"]["drives"] if (d.get("motor_torque_Nm") or 0.0) > 5000.0]
    (warning,) = [w for w in figures["warnings"] if w["name"] == "motor-torque"][:1]
    most = asked[0]["motor_torque_Nm"]
    assert (warning["joint"], warning["value"], warning["limit"]) == (
        asked[0]["joint"],
        most,
        5000.0,
    )
    text = f"its motor needs {most:.5g} N m at t = {asked[0]['motor_torque_time_s']:.3f} s; its"
    assert f"{text} torque limit is 5000 N m, {most - 5000.0:.3g} N m less" in warning["text"]
    assert figures["reason"].startswith(f"the command exceeds a motor's torque: joint 2: {text}")
    assert "NOT CONVERGED" in done.stdout


def test_what_is_asked_of_a_motor_beyond_its_limit_is_what_its_servo_asks_for(tmp_path):
    """Coupled, motors that saturate move as they can; the demand is that without their limit."""
    case = load_case(line(tmp_path, 9000.0))
    run = run_coupling(case)
    wrench = run.correction.response.wrench
    found = told(case, run.correction.joints, wrench, tmp_path, "servo")
    beyond = {i: most for i, (most, *_) in found.items() if most > 9000.0}
    assert beyond
    said = {w.joint: w.value for w in run.warnings if w.name == "motor-torque"}
    assert said == pytest.approx(beyond, rel=1e-4)


def test_a_robot_without_motors_tells_nothing_of_them(tmp_path):
    run = run_compensation(line_case(tmp_path, "native"))
    assert run.finding_of(MOTOR_TORQUES) == (None,)
    assert all(
        drive.motor_torque_Nm is None for own in run.finding_of(DRIVE_MOTION) for drive in own
    )


def test_check_estimates_what_a_run_then_asks_for(finished):
    """To 5 % and what backlash asks; friction 30 % more and less is apart by 60 % of it."""
    case, folder, _ = finished
    stored = read_run(folder).first
    (robot,) = examine_robots(case, case.process.evaluate(case.desired).wrench)
    asked = {d.joint: d.motor_torque_Nm for d in stored.figures.command.drives}
    for own in robot.motors:
        assert own.limit == 12000.0
        assert own.torque[1.0] == pytest.approx(asked[own.joint], rel=0.05, abs=70.0)
        assert abs(own.torque[COLD] - own.torque[WARM]) <= 0.6 * FRICTION + 1e-9
    apart = {own.joint: own.torque[COLD] - own.torque[WARM] for own in robot.motors}
    # It lets the arm down, so that friction helps; the third lifts.
    assert apart[2] == pytest.approx(-0.6 * FRICTION, rel=1e-3)
    assert apart[3] == pytest.approx(0.6 * FRICTION, rel=1e-3)
    assert robot.warnings == ()


def test_check_warns_of_motors_that_are_too_weak_warm_or_cold(tmp_path):
    (robot,) = examine_robots(
        (case := load_case(line(tmp_path, 9e4))), WrenchHistory.none(case.desired.time)
    )
    worst = max(robot.motors, key=lambda own: own.torque[1.0])
    own, least, most = worst.torque[1.0], *sorted(worst.torque.values())[::2]
    assert most == worst.torque[WARM]
    for limit, words, word in (
        (0.5 * (least + own), f"joint 2: its motor needs {own:.5g} N m at t = ", "yes"),
        (
            0.5 * (own + most),
            f"warm, with 30 % less friction, its motor needs {most:.5g}",
            "warm",
        ),
        (most + 0.01, "", "-"),
    ):
        done = command("check", "-v", line(tmp_path, limit), "-o", tmp_path / "check.html")
        said = " ".join(done.stdout.split())
        assert words in said
        assert ("its motor needs" in said) == bool(words)
        (row,) = re.findall(rf"joint 2 +\S+ +{own:.4g} .*", done.stdout)
        assert row.split()[-1] == word


def test_the_report_has_the_torques_over_time(finished):
    _, folder, said = finished
    assert "Demands on the motors" in said
    titles = [section.title for section in run_report(read_run(folder)).content]
    assert titles.count("Demands on the motors") == 1


def test_the_robot_of_a_cell_whose_motor_is_too_weak_is_named():
    """Its joint alone would be one of two."""

    class Standing:
        def plan(self, path):
            return JointPath(path.time, (np.zeros((len(path.time), 1)),))

    class Weak:
        def invert(self, *arguments):
            raise PlanningError("joint 1: expected at most 5 N m of motor torque")

    time = np.linspace(0.0, 1.0, 11)
    still = ToolPath(time, np.tile([0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 1.0], (11, 1)))
    members = [Member(name, AT_THE_ORIGIN, None, Standing(), Weak()) for name in ("one", "two")]
    for robots, said in ((members[:1], "joint 1"), (members, "one robot: joint 1")):
        path = SampledPath.of(ToolPath.of_tools([still] * len(robots)))
        wrench = WrenchHistory.none(time, len(robots))
        with pytest.raises(PlanningError, match=f"^{said}: expected at most 5 N m"):
            Cell(tuple(robots)).inverse(path, wrench, Controller(), 1e-6)
