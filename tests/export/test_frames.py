"""Frames, joint counts and postures of a program, of robots that are counted in three ways."""

from dataclasses import replace

import numpy as np
import pytest
from places import ROOT
from scipy.spatial.transform import Rotation

from coupling.case.file import load_case
from coupling.errors import ProgramError
from coupling.export.frames import part_frame, tool_frame, with_tool
from coupling.export.postures import Postures, nearest_singular
from coupling.files.controller_axes import ControllerAxes, controller_axes
from coupling.files.robot_file import find_robot, load_robot
from coupling.path.frame import AT_THE_ORIGIN, Frame
from coupling.programs.languages import LANGUAGES
from coupling.programs.program import ProgramMove, RobotProgram
from elastic_robot.chain import build_chain
from elastic_robot.description import Robot
from elastic_robot.errors import RobotFileError
from elastic_robot.kinematics import base_from_tool


def robot_and_axes(name: str) -> tuple[Robot, ControllerAxes]:
    file = find_robot(name)
    robot = load_robot(file)
    return robot, controller_axes(file, len(robot.joints))


def postures(name: str) -> Postures:
    return Postures(*robot_and_axes(name))


def test_fanuc_counts_joint_3_from_the_horizontal():
    _, axes = robot_and_axes("fanuc_r2000ic")
    q = np.deg2rad([[10.0, 20.0, 20.0, 0.0, -90.0, 400.0]])  # arm forward, forearm still horizontal
    angles = axes.controller_angles(q)
    np.testing.assert_allclose(np.rad2deg(angles[0]), [10, 20, 0, 0, -90, 400], atol=1e-12)
    np.testing.assert_allclose(axes.file_angles(angles), q, atol=1e-15)


@pytest.mark.parametrize(
    ("name", "z", "x"),
    [("abb_irb7600", [1, 0, 0], [0, 0, -1]), ("fanuc_r2000ic", [1, 0, 0], [0, 0, 1])],
)
def test_the_makers_flange_points_away_and_its_x_down_or_up(name, z, x):
    robot, axes = robot_and_axes(name)
    np.testing.assert_allclose(axes.last_from_flange.apply([0, 0, 1]), z, atol=1e-15)
    np.testing.assert_allclose(axes.last_from_flange.apply([1, 0, 0]), x, atol=1e-15)
    back = with_tool(robot, tool_frame(robot, axes), axes)
    np.testing.assert_allclose(back.tcp_position, robot.tcp_position, atol=1e-15)
    np.testing.assert_allclose(back.tcp_rpy, robot.tcp_rpy, atol=1e-12)


def test_the_part_is_seen_from_the_controllers_base():
    """The second robot of the cell stands 3.8 m away and looks back; its base is where the file's is."""
    case = load_case(ROOT / "examples" / "cases" / "two_robots.toml")
    frames = [
        part_frame(case.task.part, robot, ControllerAxes.as_described(6)) for robot in case.robots
    ]
    np.testing.assert_allclose(frames[0].position, [1.9, 0.0, 1.1], atol=1e-12)
    np.testing.assert_allclose(frames[1].position, [1.9, 0.0, 1.1], atol=1e-12)
    about = frames[0].rotation * frames[1].rotation.inv()
    np.testing.assert_allclose(np.abs(about.as_rotvec()), [0, 0, np.pi], atol=1e-12)
    _, axes = robot_and_axes("fanuc_r2000ic")
    lifted = part_frame(case.task.part, case.robots[0], axes)
    np.testing.assert_allclose(lifted.position, [1.9, 0.0, 1.1 - 0.67], atol=1e-12)
    assert Frame.of_pose(lifted.pose).rotation.approx_equal(lifted.rotation)


# Drive angles [deg], and behind, below, sign of joint 5.
POSTURES = {
    "home": ("abb_irb7600", [0, 0, 0, 0, 30, 0], (False, False, 1)),
    "turned": ("abb_irb7600", [120, 10, 0, 0, -30, 0], (False, False, -1)),
    "back": ("abb_irb7600", [0, -60, -60, 0, 30, 0], (True, False, 1)),
    "elbow down": ("abb_irb7600", [0, 80, -150, 0, 30, 0], (False, True, 1)),
    "fanuc, tool down": ("fanuc_r2000ic", [0, 0, 0, 0, -90, 0], (False, False, -1)),
    "fanuc, elbow down": ("fanuc_r2000ic", [0, 70, 160, 0, 60, 0], (False, True, 1)),
}


@pytest.mark.parametrize("name", POSTURES)
def test_postures_have_their_names(name):
    robot, angles, expected = POSTURES[name]
    found = postures(robot).configuration(np.deg2rad(angles))
    assert (found.behind, found.below, found.wrist) == expected


def flange_of(name: str, angles: list[float]) -> tuple[np.ndarray, Rotation]:
    """Return where the maker's flange is in the controller's frame, at its angles [deg]."""
    robot, axes = robot_and_axes(name)
    bare = with_tool(robot, AT_THE_ORIGIN, axes)
    chain = build_chain(bare)
    q = axes.file_angles(np.deg2rad([angles]))[0]
    pose = base_from_tool(chain, chain.model.createData(), chain.theta(q))
    return pose.translation - axes.base_position, Rotation.from_matrix(pose.rotation)


@pytest.mark.filterwarnings("ignore:Gimbal lock")
@pytest.mark.parametrize(
    ("angles", "config"),
    [
        ([7.962, -5.284, -36.250, 77.661, -51.975, -79.273], "N U T, 0, 0, 0"),
        ([7.962, -5.284, -36.250, -102.339, 51.975, 100.727], "F U T, 0, 0, 0"),
    ],
)
def test_published_positions_of_an_r2000_are_where_and_how_they_are_said_to_be(angles, config):
    """Angles, X Y Z W P R and configuration of [OneRobotics2013], for the 165F of the series before.

    Its last length is not given: the flange there is 55 mm farther out, the only number taken from it.
    """
    position, rotation = flange_of("fanuc_r2000ic", angles)
    wpr = Rotation.from_euler("xyz", [135.0, -45.0, 0.0], degrees=True)
    assert np.rad2deg((rotation * wpr.inv()).magnitude()) < 1e-3
    there = position + rotation.apply([0.0, 0.0, 0.055])
    np.testing.assert_allclose(there, [1.5, 0.0, 0.36], atol=5e-5)
    own, axes = postures("fanuc_r2000ic"), robot_and_axes("fanuc_r2000ic")[1]
    found = own.configuration(axes.file_angles(np.deg2rad([angles]))[0])
    pose = (1.5, 0.0, 0.36, *wpr.as_quat().tolist())
    moves = [
        ProgramMove("joint", joints=found.angles),
        ProgramMove("linear", pose, configuration=found),
    ]
    (file,) = LANGUAGES["fanuc"].write(RobotProgram("P", tuple(moves)))
    assert f"CONFIG : '{config}'" in file.text


@pytest.mark.filterwarnings("ignore:Gimbal lock")
@pytest.mark.parametrize(("second", "third"), [(-100.0, 115.0), (-60.0, 90.0), (-40.0, 85.0)])
def test_a_kuka_has_status_and_turn_that_a_controller_reported(second, third):
    """$POS_ACT of a KUKA: X 1339.90503, Y 15.9216757, A 0.0, B 89.9999466, C -0.680795908, S 6, T 19.

    Its flange is horizontal and points straight away from axis 1, so A1 is -atan(y / x), A4 = A6 = 0
    and A5 = -(A2 + A3), whatever the robot's lengths; A5 negative is the 4 in S.
    """
    pytest.importorskip("rtbdata", reason="needs rtb-data, which is in the extra 'test'")
    first = -np.rad2deg(np.arctan2(15.9216757, 1339.90503))
    angles = [first, second, third, 0.0, -(second + third), 0.0]
    position, rotation = flange_of("kuka_kr210", angles)
    reported = Rotation.from_euler("ZYX", [0.0, 89.9999466, -0.680795908], degrees=True)
    assert np.rad2deg((rotation * reported.inv()).magnitude()) < 1e-3
    assert position[1] > 0.0
    axes = robot_and_axes("kuka_kr210")[1]
    found = postures("kuka_kr210").configuration(axes.file_angles(np.deg2rad([angles]))[0])
    assert (found.status, found.turn) == (6, 19)


def test_status_of_a_kuka_kr_3_is_that_of_its_published_formula():
    """Behind axis 1 where 100 + 265 cos A2 + 270 cos(A2 + A3) < 0 mm; the elbow's bit by A3's sign.

    The formula is in [RobotForum2011]; A3 counts from the stretched arm, whose axes 3 and 4 meet.
    """
    lengths = [(0, 0, 0.35), (0.1, 0, 0), (0.265, 0, 0), (0, 0, 0), (0.27, 0, 0), (0.075, 0, 0)]
    turns = [(0, 0, -1), (0, 1, 0), (0, 1, 0), (-1, 0, 0), (0, 1, 0), (-1, 0, 0)]
    robot = robot_and_axes("icme2008")[0]
    joints = [
        replace(joint, origin=origin, axis=axis)
        for joint, origin, axis in zip(robot.joints, lengths, turns, strict=True)
    ]
    own = Postures(replace(robot, joints=tuple(joints)), ControllerAxes.as_described(6))
    seen = set()
    for q in np.random.default_rng(3).uniform(-3.0, 3.0, (200, 6)):
        found = own.configuration(q)
        behind = 100.0 + 265.0 * np.cos(q[1]) + 270.0 * np.cos(q[1] + q[2]) < 0.0
        assert found.status == behind + 2 * (q[2] >= 0.0) + 4 * (q[4] < 0.0)
        assert found.turn == sum(2**i for i in range(6) if q[i] < 0.0)
        seen.add(found.status)
    assert seen == set(range(8))


@pytest.mark.parametrize(
    ("kind", "angles"),
    [
        ("wrist", [0, 0, 0, 0, 0.5, 0]),
        ("elbow", [0, 20, -81, 0, 60, 0]),
        ("shoulder", [0, -55.0, 0, 0, 60, 0]),
    ],
)
def test_singular_postures_are_named(kind, angles):
    own, q = postures("abb_irb7600"), np.deg2rad([[0, 20, 0, 0, 60, 0], angles])
    found = nearest_singular(own, np.array([0.0, 1.0]), q, own.jacobians(q))
    assert (found.kind, found.time) == (kind, 1.0)
    assert found.value < 0.02


def test_a_wrist_whose_axes_do_not_meet_has_no_configuration():
    robot, axes = robot_and_axes("icme2008")
    joints = list(robot.joints)
    joints[4] = joints[4].__class__(**{**joints[4].__dict__, "origin": (0.6, 0.0, 0.01)})
    offset = Robot("offset", tuple(joints), tcp_position=robot.tcp_position)
    with pytest.raises(
        ProgramError, match=r"three axes meet, got axes that pass .* --targets joints"
    ):
        Postures(offset, axes).configuration(np.full(6, 0.3))
    short = Robot("short", robot.joints[:5], tcp_position=robot.tcp_position)
    five = Postures(short, ControllerAxes.as_described(5))
    with pytest.raises(ProgramError, match="a robot of six joints, got one of 5"):
        five.configuration(np.full(5, 0.3))


@pytest.mark.parametrize(
    ("keys", "message"),
    [
        (
            "joint_offset_deg = [1.0]",
            "joint_offset_deg: expected 6 angles, one for each joint, got 1",
        ),
        (
            "joint_matrix = [[1.0]]",
            r"joint_matrix: expected 6 rows of 6 numbers, got rows of \[1\]",
        ),
        (f"joint_matrix = {[[0.0] * 6] * 6}", "joint_matrix: expected one that has an inverse"),
        ("flange = 1", "unknown key 'flange'"),
    ],
)
def test_a_controller_that_does_not_fit_is_refused(tmp_path, keys, message):
    file = tmp_path / "robot.toml"
    text = (
        find_robot("icme2008")
        .read_text()
        .replace("[sources]", f"[controller]\n{keys}\n\n[sources]")
    )
    file.write_text(text)
    with pytest.raises(RobotFileError, match=message):
        controller_axes(file, 6)


def test_offsets_and_signs_are_taken(tmp_path):
    file = tmp_path / "robot.toml"
    signs = np.diag([-1.0, 1, 1, -1, 1, -1]).tolist()
    keys = f"joint_matrix = {signs}\njoint_offset_deg = [0.0, -90.0, 90.0, 0.0, 0.0, 0.0]"
    text = (
        find_robot("icme2008")
        .read_text()
        .replace("[sources]", f"[controller]\n{keys}\n\n[sources]")
    )
    file.write_text(text)
    load_robot(file)
    axes = controller_axes(file, 6)
    q = np.array([[0.1, 0.2, 0.3, 0.4, 0.5, 0.6]])
    found = axes.controller_angles(q)
    expected = [-0.1, 0.2 - np.pi / 2, 0.3 + np.pi / 2, -0.4, 0.5, -0.6]
    np.testing.assert_allclose(found[0], expected, atol=1e-15)
    assert Rotation.identity().approx_equal(axes.last_from_flange)
