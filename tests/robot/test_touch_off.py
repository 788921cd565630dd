"""Parts that are touched off by robots that sag."""

import io
import zipfile
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from line_case import line_case
from places import CASES
from random_robots import make_robot, with_gear_parts, with_hysteresis
from scipy.spatial.transform import Rotation

from coupling.case.file import load_case
from coupling.errors import CaseError, PlanningError
from coupling.files.csv_table import read_table, write_table
from coupling.fmu_export.ssp import SspSystem
from coupling.path.deviation import measure
from coupling.path.frame import AT_THE_ORIGIN, Frame
from coupling.path.histories import ToolPath, WrenchHistory
from coupling.path.joint_path import JointPath
from coupling.report.stored_result import write_report
from coupling.robot.inverse_kinematics import InverseKinematics
from coupling.robot.touch_off import RestingRobot, TouchOff
from coupling.run.execute import run_compensation, run_coupling
from coupling.run.fmu_pool import FmuPool, cell_of
from coupling.run.folder import write_run
from elastic_robot.chain import build_chain
from elastic_robot.description import Joint, Robot
from elastic_robot.kinematics import base_from_tool
from elastic_robot.robot import ElasticRobot
from elastic_robot.tool_load import Load
from elastic_robot.trajectory import HeldCommand, read_trajectory

PART = "[part]"
POINTS = [[0.0, 0.0, 0.0], [0.1, 0.0, 0.0], [0.0, 0.1, 0.02]]
THREE = str(POINTS)
TURNED = Frame(np.array([0.3, -0.2, 0.1]), Rotation.from_euler("xyz", [0.1, 0.2, 2.0]))


def touching(value: str) -> tuple[str, str]:
    return (PART, f"{PART}\ntouch_off = {value}")


def resting(robot: Robot, seed: int, at: Frame) -> tuple[RestingRobot, np.ndarray, Rotation]:
    """A robot, three points around its TCP in a random posture, and the tool's orientation there."""
    rng = np.random.default_rng(seed)
    home, chain = rng.uniform(-1.0, 1.0, len(robot.joints)), build_chain(robot)
    pose = base_from_tool(chain, chain.model.createData(), chain.theta(home))
    middle = at.points(pose.translation)
    rotation = at.rotation * Rotation.from_matrix(pose.rotation)
    return RestingRobot(robot, "linear", home, at), middle + rng.normal(0, 0.02, (3, 3)), rotation


@pytest.mark.parametrize("seed", range(4))
def test_a_frame_touched_off_with_a_rigid_robot_is_unchanged(seed):
    robot = make_robot(seed, 6)
    joints = tuple(
        Joint(origin=j.origin, axis=j.axis, body=j.body, stiffness=None) for j in robot.joints
    )
    rigid = replace(robot, joints=joints)
    own, points, rotation = resting(rigid, seed, TURNED)
    found = TouchOff.of(points, own.tool_at(points, rotation)).real_from_shown
    np.testing.assert_allclose(
        found.position, 0.0, rtol=0, atol=1e-8
    )  # lever 1 m of 0.1 nm / 20 mm
    assert found.rotation.magnitude() < 1e-8


@pytest.mark.parametrize("parts", [with_hysteresis, with_gear_parts])
@pytest.mark.parametrize("seed", range(4))
def test_gears_come_to_every_point_from_no_load_with_all_they_have(seed, parts):
    """The robot that starts there is at the same place; without its parts it is at another."""
    plain = make_robot(seed, 6)
    own, points, rotation = resting(parts(plain, seed), seed, TURNED)
    found = own.tool_at(points, rotation)
    near = own.home
    for point, real in zip(points, found, strict=True):
        still = ToolPath.with_rotation(np.array([0.0, 1.0]), np.array([point, point]), rotation)
        path = still.transformed(TURNED.inverse())
        near = InverseKinematics(own.robot, near).plan(path).q[0][0]
        robot = ElasticRobot(own.robot, "linear", quasistatic=True)
        robot.reset(0.0, HeldCommand(0.0, near, 0.0 * near, 0.0 * near), Load())
        np.testing.assert_allclose(TURNED.points(robot.tcp()[:3]), real, rtol=0, atol=1e-12)
    without = replace(own, robot=plain).tool_at(points, rotation)
    assert np.abs(without - found).max() > 1e-6


@pytest.mark.parametrize("seed", range(4))
def test_three_touched_points_tell_the_frame_that_fits_them_best(seed):
    """No displacement near it comes closer to the points, in the sum of squares."""
    own, points, rotation = resting(make_robot(seed, 6), seed, TURNED)
    real = own.tool_at(points, rotation)
    touch_off, rng = TouchOff.of(points, real), np.random.default_rng(seed)
    found = touch_off.real_from_shown
    residual = np.linalg.norm(found.points(points) - real, axis=1).max()
    assert residual == pytest.approx(touch_off.residual)

    def left(turn: np.ndarray, shift: np.ndarray) -> float:
        moved = real.mean(axis=0) + Rotation.from_rotvec(turn).apply(
            found.points(points) - real.mean(axis=0)
        )
        return float(np.sum((moved + shift - real) ** 2))

    best = left(np.zeros(3), np.zeros(3))
    size = 0.1 * np.linalg.norm(real - points, axis=1).max()
    for _ in range(20):
        assert left(10.0 * size * rng.normal(size=3), size * rng.normal(size=3)) > best


@pytest.mark.parametrize("seed", range(3))
def test_a_command_to_real_points_brings_the_sagging_tool_there(seed):
    own, points, rotation = resting(make_robot(seed, 6), seed, TURNED)
    commanded = own.command_for(points, rotation)
    np.testing.assert_allclose(own.tool_at(commanded, rotation), points, rtol=0, atol=1e-9)


def test_the_simulated_robot_commanded_to_the_touched_point_rests_where_the_part_is(tmp_path):
    """The FMU without a load, at the origin of [part] as its controller shows it."""
    case = line_case(tmp_path, "native", touching("true"))
    untouched = line_case(tmp_path, "native").task
    tool = untouched.forming.rotations[0][0].as_quat()
    pose = np.tile([*untouched.part.position, *tool], (2, 1))
    time = np.array([0.0, 0.1])
    with FmuPool("native") as fmus:
        cell, _ = cell_of(case.robots, fmus)
        joints = cell.members[0].planner.plan(
            ToolPath(time, pose).transformed(cell.members[0].world_from_base.inverse())
        )
        there = cell.simulate(JointPath(time, joints.q), WrenchHistory.none(time, 1), "quasistatic")
    np.testing.assert_allclose(there.position[0, 0], case.task.part.position, rtol=0, atol=1e-9)
    assert np.linalg.norm(case.task.part.position - untouched.part.position) > 1e-4


def test_the_second_robot_of_a_cell_is_calibrated_at_the_same_points(tmp_path):
    text = (CASES / "two_robots.toml").read_text()
    file = tmp_path / "two.toml"
    # Gears that carry nothing would rest now on one flank and now on the other.
    text = text.replace("home_deg ", 'torque_curve = "linear"\nhome_deg ')
    file.write_text(text.replace(PART, f"{PART}\ntouch_off = {THREE}", 1))
    case, plain = load_case(file), load_case(CASES / "two_robots.toml")
    part, points = case.task.part, np.array(POINTS)
    real = part.points(points)
    forming, support = case.robots
    shown = forming.touch_off.real_from_shown.coordinates(part.position)
    np.testing.assert_allclose(shown, plain.task.part.position, rtol=0, atol=1e-12)
    own = RestingRobot(
        support.description, support.torque_curve, support.home, support.world_from_base
    )
    commanded = support.touch_off.real_from_shown.coordinates(real)
    there = own.tool_at(commanded, plain.desired.rotations[1][0])
    limit = 2.0 * support.touch_off.residual + 1e-7
    np.testing.assert_allclose(there, real, rtol=0, atol=limit)


def test_touch_off_takes_the_constant_out_of_the_deviation_and_of_the_correction(tmp_path):
    plain, touched = (
        line_case(tmp_path / name, "native", *changes)
        for name, changes in (("a", ()), ("b", (touching("true"),)))
        if not (tmp_path / name).mkdir()
    )
    before, after = run_compensation(plain), run_compensation(touched)
    own, other = (measure(run.before, run.desired) for run in (before, after))
    assert other.maximum < 0.5 * own.maximum
    # What is left without the constant is that of the same robot, a sag beside.
    assert other.rms_less_constant == pytest.approx(own.rms_less_constant, rel=0.05)
    for run in (before, after):
        assert measure(run.correction.achieved, run.desired).maximum < 1e-6
    sizes = [np.abs(run.correction.correction[..., :3]).max() for run in (before, after)]
    assert sizes[1] < 0.5 * sizes[0]
    (tmp_path / "run").mkdir()
    write_run(tmp_path / "run", touched, after)
    page = write_report(tmp_path / "run").read_text()
    assert "touched off by the robot with its sag" in page
    assert "less a constant" in page


def test_the_package_for_other_tools_starts_from_the_programmed_path(tmp_path):
    """Its first joint angles put the undeflected tool where the controller shows the path's start."""
    case = line_case(tmp_path, "native", touching("true"))
    file = SspSystem.of(case).write(tmp_path / "case.ssp", ["linux64"])
    with zipfile.ZipFile(file) as archive:
        fmu = zipfile.ZipFile(io.BytesIO(archive.read("resources/ElasticRobot.fmu")))
        name = next(n for n in fmu.namelist() if n.endswith("command.npz"))
        motion = read_trajectory(Path(fmu.extract(name, tmp_path)), len(case.robots[0].home))
        first = motion.at(np.zeros(1))[0, 0]
    robot = case.robots[0]
    chain = build_chain(robot.description)
    at = base_from_tool(chain, chain.model.createData(), chain.theta(first))
    program = robot.programmed(case.desired).position[0, 0]
    np.testing.assert_allclose(at.translation, program, rtol=0, atol=1e-9)


@pytest.mark.parametrize(
    ("value", "said"),
    [
        ("[[0.0, 0.0, 0.0], [0.1, 0.0, 0.0]]", "at least three"),
        ("[[0.0, 0.0, 0.0], [0.1, 0.0, 0.0], [0.2, 0.0, 0.0]]", "on a line"),
        ("[]", "at least three"),
        ("[[0.0, 0.0]]", "touch_off"),
        ('"yes"', "touch_off"),
        ("[[50.0, 0.0, 0.0]]", "out of reach.*give points"),
    ],
)
def test_touched_points_that_tell_no_frame_are_refused(tmp_path, value, said):
    with pytest.raises(CaseError, match=said):
        line_case(tmp_path, "native", touching(value))


def test_a_point_out_of_reach_is_named():
    own, points, rotation = resting(make_robot(1, 6), 1, AT_THE_ORIGIN)
    with pytest.raises(PlanningError, match=r"point 2, at .* out of reach"):
        own.tool_at(points + np.array([[0.0], [40.0], [0.0]]), rotation)


def test_a_robot_that_rests_beside_its_points_is_refused(monkeypatch):
    """A gear is unloaded in its backlash: the tool rests 50 um on one side of the point or the other."""
    own, points, rotation = resting(make_robot(1, 6), 1, AT_THE_ORIGIN)

    def hanging(robot, commanded, rotation):
        return commanded + 5e-5 * np.where(commanded > points, 1.0, -1.0)

    monkeypatch.setattr(RestingRobot, "tool_at", hanging)
    with pytest.raises(PlanningError, match="is unloaded in its backlash"):
        own.command_for(points, rotation)


def test_a_touched_off_case_runs_again_from_its_folder_to_the_same_part(tmp_path: Path):
    case = line_case(tmp_path, "native", touching(THREE))
    (tmp_path / "run").mkdir()
    write_run(tmp_path / "run", case, run_coupling(case))
    again = load_case(tmp_path / "run" / "case.toml")
    np.testing.assert_array_equal(again.task.part.position, case.task.part.position)


def test_a_deviation_is_mirrored_as_it_is_where_the_part_was_touched_off(tmp_path, command):
    """0.1 mm at 0.5 Hz across the path is what its robot does beyond the model, in axes of the world.

    Less its mean, as without a frame that is known.
    """
    case = line_case(tmp_path, "native", SLOW, touching("true"))
    run = run_compensation(case)
    out = tmp_path / "run"
    out.mkdir()
    write_run(out, case, run)
    found = run.correction.achieved
    position = found.position[0] + [0.0, 1.0, 0.0] * wave(found.time)[:, None]
    measured = np.column_stack([found.time, position])
    write_table(tmp_path / "m.csv", ("time", "x", "y", "z"), measured)
    options = ("--cutoff-Hz", "2.5", "-o", tmp_path / "next")
    command("mirror", out, tmp_path / "m.csv", *options, exits=0)
    file = tmp_path / "next_inputs" / "discrepancy.csv"
    time, beyond = read_table(file, ("time", "dy"), AssertionError).T
    inner = (time > 0.5) & (time < time[-1] - 0.5)
    expected = wave(time[inner]) - wave(found.time).mean()
    np.testing.assert_allclose(beyond[inner], expected, rtol=0, atol=2e-6)


SLOW = ("""feed_m_s = 0.1""", "feed_m_s = 0.015")  # [m/s]: 4 s and more


def wave(time: np.ndarray) -> np.ndarray:
    return 1e-4 * np.sin(2.0 * np.pi * 0.5 * time)
