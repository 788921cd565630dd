"""Frames, joint counts and postures of a program, of robots that are counted in three ways."""

from __future__ import annotations

import numpy as np
import pytest
from places import ROOT
from scipy.spatial.transform import Rotation

from coupling.case import load_case
from coupling.errors import ProgramError
from coupling.export.frames import Placed, part_frame, tool_frame, with_tool
from coupling.export.postures import Postures, nearest_singular
from coupling.files.controller_axes import ControllerAxes, controller_axes
from coupling.files.robot_file import find_robot, load_robot
from elastic_robot.description import Robot
from elastic_robot.errors import RobotFileError


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
    assert Placed.of(lifted.pose).rotation.approx_equal(lifted.rotation)


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
    found = nearest_singular(own, np.array([0.0, 1.0]), q, own.jacobians(q), reach=3.0)
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
