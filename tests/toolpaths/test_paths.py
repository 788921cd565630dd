"""Tool paths, planning and tables."""

import os
from dataclasses import replace

import numpy as np
import pytest
from hypothesis import assume, given
from hypothesis import strategies as st
from random_robots import make_robot
from scipy.spatial.transform import Rotation

from coupling.case.file import load_case
from coupling.errors import CaseError, PlanningError
from coupling.files.csv_table import POSE_COLUMNS, read_table, write_table
from coupling.path.deviation import measure
from coupling.path.frame import Frame
from coupling.path.histories import ToolPath, WrenchHistory
from coupling.robot.batch.rigid_robot import RigidRobot
from coupling.robot.inverse_kinematics import InverseKinematics
from coupling.toolpaths import Cone, CsvPath, Iso9283, Line, Pyramid
from elastic_robot.chain import build_chain
from elastic_robot.kinematics import base_from_tool, pose_of

HOME = np.deg2rad([0.0, 10.0, 20.0, 0.0, 60.0, 0.0])
FLAT = Frame(np.array([1.6, 0.0, 0.8]), Rotation.identity())
CONTOURS = {
    "radius_m": 0.03,
    "wall_angle_deg": 60.0,
    "step_down_m": 0.001,
    "depth_m": 0.0035,
    "feed_m_s": 0.05,
    "clearance_m": 0.004,
    "sample_s": 0.01,
}


def _on_the_wall(z: np.ndarray) -> np.ndarray:
    """Samples below the sheet's plane, before the tool is lifted off the last contour."""
    return (z < -1e-12) & (np.arange(len(z)) <= np.flatnonzero(z < z.min() + 1e-12)[-1])


def test_cone_lies_on_its_cone():
    path = Cone(kind="cone", **CONTOURS).untilted(FLAT).sampled.path
    x, y, z = FLAT.coordinates(path.position[0]).T
    lateral = np.hypot(x, y) - (0.03 + z / np.tan(np.deg2rad(60.0)))
    np.testing.assert_allclose(lateral[_on_the_wall(z)], 0.0, atol=1e-12)
    assert z.min() == pytest.approx(-0.0035, abs=1e-15)
    np.testing.assert_allclose([z.max(), z[0], z[-1]], 0.004, rtol=0, atol=1e-12)
    depths = np.unique(np.round(-z[np.isclose(np.gradient(z), 0) & (z < 0)], 9))
    np.testing.assert_allclose(depths, [0.001, 0.002, 0.003, 0.0035], atol=1e-9)


def test_pyramid_lies_on_its_planes():
    path = Pyramid(kind="pyramid", **CONTOURS).path(FLAT)
    x, y, z = FLAT.coordinates(path.position[0]).T
    half = np.maximum(np.abs(x), np.abs(y)) - (0.03 + z / np.tan(np.deg2rad(60.0)))
    np.testing.assert_allclose(half[_on_the_wall(z)], 0.0, atol=1e-12)
    corner = np.isclose(np.abs(x), np.abs(y), atol=1e-12)
    assert corner.sum() >= 4 * 4  # every corner of every contour is a sample


def test_iso_path_has_its_elements_in_an_inclined_plane():
    part = Frame(np.array([1.9, 0.0, 1.0]), Rotation.from_euler("y", 45, degrees=True))
    path = Iso9283(kind="iso9283", size_m=0.4, feed_m_s=0.2, sample_s=0.005).path(part)
    x, y, z = part.coordinates(path.position[0]).T
    np.testing.assert_allclose(z, 0.0, atol=1e-12)
    assert np.ptp(x) == pytest.approx(0.4, abs=1e-12)
    assert np.ptp(y) == pytest.approx(0.4, abs=1e-12)
    for radius in (0.16, 0.02):  # 80 % and 10 % of the size, as diameters: whole turns
        on_circle = np.isclose(np.hypot(x, y), radius, atol=1e-9)
        angles = np.sort(np.arctan2(y[on_circle], x[on_circle]))
        assert on_circle.sum() > 40
        assert np.diff(angles).max() < 0.4
    on_diagonal = np.isclose(x, y, atol=1e-12)
    assert np.ptp(x[on_diagonal]) == pytest.approx(0.4, abs=1e-12)
    assert np.allclose(path.pose[0, :, 3:], path.pose[0, 0, 3:])


def test_motion_keeps_the_feed_and_stops_in_corners():
    path = Pyramid(kind="pyramid", **CONTOURS).untilted(FLAT).sampled.path
    steps = np.diff(path.time)
    speed = np.linalg.norm(np.diff(path.position[0], axis=0), axis=1) / steps
    assert speed.max() <= 0.05 * (1 + 1e-9)
    assert np.sort(speed)[len(speed) // 2] > 0.03
    # Each of the 26 motions from rest to rest takes at least 0.4 s, in equal steps.
    assert steps.min() >= 0.01 * 40 / 41
    assert steps.max() <= 0.01 + 1e-12
    # Smooth starts: the acceleration between samples stays within 15/8 feed / blend.
    acceleration = np.diff(path.position[0], 2, axis=0) / (steps[1:] * steps[:-1])[:, None]
    assert np.linalg.norm(acceleration, axis=1).max() < 1.02 * 15 / 8 * 0.05 / 0.2


def test_tool_axes_in_the_part():
    turned = Frame(np.zeros(3), Rotation.from_euler("xyz", [10, 20, 30], degrees=True))
    line = Line(kind="line", points_m=[[0.0, 0.0, 0.0], [0.1, 0.0, 0.0]], feed_m_s=0.1)
    tool = turned.rotation.inv() * line.path(turned).rotations[0][0]
    expected = np.array([[0.0, 0.0, 1.0], [0.0, 1.0, 0.0], [-1.0, 0.0, 0.0]])
    np.testing.assert_allclose(tool.as_matrix(), expected, atol=1e-15)


def test_csv_path_is_placed_by_the_part(tmp_path):
    pose = np.array([[0.1, 0.0, 0.0, 0.0, 0.0, 0.0, 1.0], [0.2, 0.0, 0.0, 0.0, 0.0, 0.0, 1.0]])
    file = tmp_path / "path.csv"
    write_table(file, ("time", *POSE_COLUMNS), np.column_stack([[0.0, 1.0], pose]))
    part = Frame(np.array([1.0, 2.0, 3.0]), Rotation.from_euler("z", 90, degrees=True))
    path = CsvPath(kind="csv", file=file).path(part)
    np.testing.assert_allclose(path.position[0], [[1.0, 2.1, 3.0], [1.0, 2.2, 3.0]], atol=1e-15)
    np.testing.assert_allclose(
        path.rotations[0].as_matrix()[0], part.rotation.as_matrix(), atol=1e-15
    )


def test_a_csv_path_is_sampled_between_its_rows_as_finely_as_asked(tmp_path):
    """Rows 20 ms apart of a smooth motion, sampled every millisecond: on it to a micrometre."""

    def motion(time: np.ndarray) -> np.ndarray:
        u = time / time[-1]
        x = 0.05 * u**4 * (35.0 - 84.0 * u + 70.0 * u**2 - 20.0 * u**3)
        return np.column_stack([x, 0.02 * np.sin(np.pi * x / 0.05), 0.0 * x])

    coarse, fine = np.linspace(0.0, 1.0, 51), np.linspace(0.0, 1.0, 1001)
    pose = np.hstack([motion(coarse), np.tile([0.0, 0.0, 0.0, 1.0], (51, 1))])
    file = tmp_path / "path.csv"
    write_table(file, ("time", *POSE_COLUMNS), np.column_stack([coarse, pose]))
    path = CsvPath(kind="csv", file=file, sample_s=1e-3).task(FLAT)
    np.testing.assert_allclose(path.forming.time, fine, atol=1e-12)
    position = FLAT.coordinates(path.forming.position[0])
    np.testing.assert_allclose(position, motion(fine), atol=1e-6)
    np.testing.assert_allclose(position[::20], pose[:, :3], atol=1e-12)
    assert len(path.sample_rows) == 1001
    with pytest.raises(CaseError, match="sample_s"):
        CsvPath(kind="csv", file=file, sample_s=1e-8).task(FLAT)


def test_columns_that_a_csv_path_does_not_need_are_told(tmp_path):
    file = tmp_path / "path.csv"
    file.write_text("time,x,y,z,qx,qy,qz,qw,feed\n0,0,0,0,0,0,0,1,5\n1,0.01,0,0,0,0,0,1,5\n")
    assert CsvPath(kind="csv", file=file).task(FLAT).remarks == (
        "path.csv: columns left out: feed",
    )


def test_times_in_milliseconds_are_asked_for(tmp_path):
    """10 mm in 1000 s are 0.01 mm/s, as 10 mm in 1 s are with times in milliseconds."""
    file = tmp_path / "path.csv"
    file.write_text("time,x,y,z,qx,qy,qz,qw\n0,0,0,0,0,0,0,1\n1000,0.01,0,0,0,0,0,1\n")
    assert CsvPath(kind="csv", file=file).task(FLAT).remarks == (
        "path.csv: the tool goes at most 0.01 mm/s: are times in seconds, places in metres?",
    )


@pytest.mark.parametrize(
    ("text", "words"),
    [
        ("time,x,y,z\n0,0,0,0\n", ["qx, qy, qz, qw are missing", "expected time, x"]),
        ("", ["qz, qw are missing", "got an empty file"]),
        ("time;x;y;z;qx;qy;qz;qw\n0;0;0;0;0;0;0;1\n", ["got time;x;", "columns by commas"]),
        (
            "time,x,y,z,qx,qy,qz,qw\n0,0,0,0,0,0,0,1\n1,0,0\n",
            ["the number of columns changed from 8 to 3 at row 2"],
        ),
        ("time,x,y,z,qx,qy,qz,qw\n", ["expected rows of 8 numbers, one for each name, got none"]),
        (
            "time,x,y,z,qx,qy,qz,qw\n1,0,0,0,0,0,0,1\n0,0,0,0,0,0,0,1\n",
            ["got 0 s after 1 s in row 2"],
        ),
        (
            "time,x,y,z,qx,qy,qz,qw\n0,0,0,0,0,0,0,1\n1,nan,0,0,0,0,0,1\n",
            ["x: expected a finite number, got nan in row 2"],
        ),
        (
            "time,x,y,z,qx,qy,qz,qw\n0,0,0,0,0,0,0,2\n1,0,0,0,0,0,0,1\n",
            ["quaternions of length 1, got length 2 in row 1"],
        ),
        (
            "time,x,y,z,qx,qy,qz,qw\n0,0,0,0,0,0,0,1\n1,a,0,0,0,0,0,1\n",
            ["not a table of numbers", "'a'", "in row 2, column 2"],
        ),
        ("x_mm;y_mm;z_mm;a;b;c\n0;0;0;0;90;0\n", ["expected time, x, y", "in s, m and the unit"]),
        (
            "time,x,y,z,qx,qy,qz,qw\n0,0,0,0,0,0,0,1\n9,-950,0,0,0,0,0,1\n",
            ["x, y, z: expected metres, got values up to 950: divide millimetres by 1000"],
        ),
        (
            "time,x,y,z,qx,qy,qz,qw\n0,0,0,0,0,0,0,1\n0.1,15,0,0,0,0,0,1\n",
            ["expected metres and seconds, at most 10 m/s, got 150 m/s to row 2"],
        ),
    ],
)
def test_a_broken_csv_path_is_named_with_what_is_wrong(tmp_path, text, words):
    file = tmp_path / "broken.csv"
    file.write_text(text)
    with pytest.raises(CaseError) as caught:
        CsvPath(kind="csv", file=file).path(FLAT)
    assert [word for word in [str(file), *words] if word not in str(caught.value)] == []


@given(st.integers(0, 10**6), st.integers(1, 50))
def test_tables_survive_the_round_trip_exactly(tmp_path_factory, seed, rows):
    rng = np.random.default_rng(seed)
    data = rng.normal(size=(rows, 2)) * 10.0 ** rng.integers(-300, 300, (rows, 2))
    file = tmp_path_factory.mktemp("table") / "t.csv"
    write_table(file, ("a", "b"), data)
    assert np.array_equal(read_table(file, ("a", "b"), CaseError), data)


def test_a_table_of_a_spreadsheet_is_read(tmp_path):
    """With the mark of its encoding and the ends of lines that Excel writes."""
    file = tmp_path / "t.csv"
    file.write_bytes("\ufefftime,x\r\n0,1.5\r\n1,2.5\r\n".encode())
    found = read_table(file, ("time", "x"), CaseError)
    assert found.tolist() == [[0.0, 1.5], [1.0, 2.5]]


def test_inverse_kinematics_returns_to_the_path(example):
    path = Cone(kind="cone", **CONTOURS).path(
        Frame(np.array([1.5, 0.3, 0.9]), Rotation.from_euler("z", 0.4))
    )
    joints = InverseKinematics(example, HOME).plan(path)
    chain = build_chain(example)
    data = chain.model.createData()
    poses = np.array([pose_of(base_from_tool(chain, data, chain.theta(q))) for q in joints.q[0]])
    deviation = ToolPath(path.time, poses).deviation_from(path)
    assert np.abs(deviation).max() < 2e-10
    assert np.abs(np.diff(joints.q[0], axis=0)).max() < 0.01


@given(st.integers(0, 10**6), st.integers(2, 6))
def test_a_plan_is_the_motion_that_made_the_path(seed, joints):
    """Of random robots, with a kink on the way: to 1e-10 in the pose, whatever it takes to plan it."""
    rng = np.random.default_rng(seed)
    robot, time = make_robot(seed, joints), np.linspace(0.0, 1.0, 301)
    wave = np.sin(
        2.0 * np.pi * np.outer(time, rng.uniform(0.2, 0.6, joints)) + rng.normal(size=joints)
    )
    q = rng.uniform(-1.0, 1.0, joints) + 0.15 * wave + 0.2 * np.abs(time - 0.4771)[:, None]
    planner = InverseKinematics(robot, q[0])
    path = ToolPath(time, planner.poses(q))
    serial = RigidRobot(robot)
    posture = serial.posture(q.T, np.zeros((3, len(time))))
    scaled = np.concatenate([posture.lever / serial.reach, posture.axis], axis=1)
    least = np.linalg.svd(scaled.transpose(2, 1, 0), compute_uv=False).min()
    assume(least > 1e-2)
    for own in (path, path.at_rows(np.arange(100))):
        found = planner.plan(own).q[0]
        np.testing.assert_allclose(found, q[: len(found)], rtol=0, atol=2e-10 / least)
        assert np.abs(ToolPath(own.time, planner.poses(found)).deviation_from(own)).max() < 2e-10


def _line(*points, part=FLAT):
    return Line(kind="line", points_m=[list(p) for p in points], feed_m_s=0.5).path(part)


def test_a_point_out_of_reach_is_named(example):
    with pytest.raises(
        PlanningError, match=r"sample \d+, t = .* out of reach.*mm away.*joint"
    ) as caught:
        InverseKinematics(example, HOME).plan(_line((0.0, 0.0, 0.0), (2.0, 0.0, 0.0)))
    assert "sample 1," not in str(caught.value)


def test_a_joint_limit_is_named_with_sample_and_angle(example):
    joints = list(example.joints)
    joints[0] = replace(joints[0], limits=(-0.05, 0.05))
    robot = replace(example, joints=tuple(joints))
    with pytest.raises(
        PlanningError, match=r"sample \d+.*joint 1 is at .* limits are -2.86 to 2.86 deg"
    ):
        InverseKinematics(robot, HOME).plan(_line((0.0, 0.0, 0.0), (0.0, 0.3, 0.0)))


def test_a_singular_posture_is_named(example):
    """Tool axis and forearm in line: axes 4 and 6 coincide."""
    home = np.array([0.0, 0.2, 0.3, 0.0, 0.0, 0.0])
    chain = build_chain(example)
    start = pose_of(base_from_tool(chain, chain.model.createData(), chain.theta(home)))
    path = ToolPath(np.array([0.0, 1.0]), np.vstack([start, start]))
    with pytest.raises(PlanningError, match=r"sample 1.*singular posture.*joint [46]"):
        InverseKinematics(example, home).plan(path)


def test_too_fast_joints_are_warned_of_with_the_time(example):
    joints = list(example.joints)
    joints[0] = replace(joints[0], max_rate=0.1)
    planner = InverseKinematics(replace(example, joints=tuple(joints)), HOME)
    slow = planner.plan(_line((0.0, 0.0, 0.0), (0.0, 0.01, 0.0)))
    fast = planner.plan(_line((0.0, 0.0, 0.0), (0.0, 0.4, 0.0)))
    assert planner.rate_warnings(slow) == []
    (warning,) = planner.rate_warnings(fast)
    assert warning.joint == 1
    assert warning.name == "rate"
    assert 0.2 < warning.value < 0.4
    assert "maximum rate is 0.1 rad/s" in str(warning)
    assert f"t = {warning.time:.3f} s" in str(warning)


def test_home_of_the_wrong_length_is_refused(example):
    with pytest.raises(PlanningError, match=r"home: expected 6 angles, .*, got 5"):
        InverseKinematics(example, HOME[:5])


@given(st.integers(0, 10**6))
def test_displacing_by_a_deviation_returns_it(seed):
    rng = np.random.default_rng(seed)
    quaternion = Rotation.random(4, random_state=seed).as_quat()
    path = ToolPath(np.arange(4.0), np.hstack([rng.normal(size=(4, 3)), quaternion]))
    deviation = 0.1 * rng.normal(size=(4, 6))
    moved = path.displaced(deviation)
    np.testing.assert_allclose(moved.deviation_from(path)[0], deviation, rtol=0, atol=1e-14)


def test_deviation_is_split_along_and_across_the_travel():
    path = _line((0.0, 0.0, 0.0), (0.1, 0.0, 0.0))
    offset = np.tile([3e-3, 4e-3, 0.0, 0.0, 0.0, 0.0], (len(path.time), 1))
    figures = measure(path.displaced(offset), path)
    assert figures.maximum == pytest.approx(5e-3, rel=1e-9)
    assert figures.rms == pytest.approx(5e-3, rel=1e-9)
    assert figures.tangential_maximum == pytest.approx(3e-3, rel=1e-6)
    middle = np.linalg.norm(offset[0, :3])
    assert figures.normal_maximum <= middle + 1e-12


def test_what_a_shift_of_the_part_leaves_is_told_over_time_whatever_the_samples_distances():
    """A deviation c + a t, t in 0 to 1: less its mean at most a / 2, rms a / sqrt(12)."""
    time = np.sort(np.append(np.linspace(0.0, 1.0, 51), np.linspace(0.9, 1.0, 2000)[1:-1]))
    path = ToolPath(time, np.tile([1.0, 0, 0, 0, 0, 0, 1], (len(time), 1)))
    off = np.zeros((len(time), 6))
    off[:, :3] = np.array([3e-3, -4e-3, 1e-3]) + 2e-4 * time[:, None] * np.array([0.0, 0.6, 0.8])
    figures = measure(path.displaced(off), path)
    assert figures.maximum_less_constant == pytest.approx(1e-4, rel=1e-9)
    assert figures.rms_less_constant == pytest.approx(2e-4 / np.sqrt(12.0), rel=1e-3)
    mean = np.array([3e-3, -3.94e-3, 1.08e-3])
    assert figures.rms == pytest.approx(
        np.hypot(np.linalg.norm(mean), 2e-4 / np.sqrt(12.0)), rel=1e-5
    )


@pytest.mark.skipif(not hasattr(os, "mkfifo"), reason="needs pipes with names")
def test_a_table_from_a_pipe_is_refused_and_not_waited_for(tmp_path):
    os.mkfifo(tmp_path / "p.csv")
    with pytest.raises(CaseError, match=r"p\.csv: expected a file, got a pipe"):
        read_table(tmp_path / "p.csv", ("time",), CaseError)


def test_histories_refuse_what_is_no_history():
    time = np.array([0.0, 1.0])
    with pytest.raises(ValueError, match="7"):
        ToolPath(time, np.zeros((2, 6)))
    with pytest.raises(ValueError, match="not finite"):
        WrenchHistory(time, np.full((2, 6), np.inf))
    with pytest.raises(ValueError, match="rising"):
        WrenchHistory(time[::-1], np.zeros((2, 6)))


def test_case_names_a_path_relative_to_itself(tmp_path):
    """A csv path and a robot.toml beside the case are found from anywhere."""
    from places import LINE_CASE

    from coupling.files.robot_file import shipped_robots

    (tmp_path / "my_robot.toml").write_text(shipped_robots()["icme2008"].read_text())
    pose = np.tile([0.0, 0.0, 0.0, 0.0, 0.70710678118654752, 0.0, 0.70710678118654752], (3, 1))
    write_table(
        tmp_path / "p.csv", ("time", *POSE_COLUMNS), np.column_stack([[0.0, 0.5, 1.0], pose])
    )
    text = (LINE_CASE).read_text()
    start, end = text.index("[tool_path]"), text.index("[process]")
    text = text[:start] + '[tool_path]\nkind = "csv"\nfile = "p.csv"\n' + text[end:]
    (tmp_path / "case.toml").write_text(text.replace('"icme2008"', '"my_robot.toml"'))
    case = load_case(tmp_path / "case.toml")
    assert len(case.desired.time) == 3
    assert case.resolved["tool_path"]["file"] == str(tmp_path / "p.csv")
    assert case.resolved["robot"]["description"] == str(tmp_path / "my_robot.toml")
