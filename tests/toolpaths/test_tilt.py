"""A tool whose tilt is measured from feed and normal of its path."""

import io
import json
import zipfile

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.spatial.transform import Rotation

from coupling.errors import CaseError
from coupling.files.csv_table import POSE_COLUMNS, write_table
from coupling.fmu_export.ssp import SspSystem
from coupling.path.deviation import measure
from coupling.path.frame import Frame
from coupling.path.histories import ToolPath
from coupling.run.execute import run_compensation
from coupling.run.fmu_pool import FmuPool, cell_of
from coupling.solve.correction import Uncorrected
from coupling.toolpaths import Cone, CsvPath, Iso9283, Line, Pyramid
from coupling.toolpaths.table import MAX_TURN_RATE
from coupling.toolpaths.tilt import APPROACH
from docs.scripts.runs import example

PART = Frame(np.array([1.4, -0.3, 0.7]), Rotation.from_euler("xyz", [0.2, -0.3, 0.7]))
ALPHA = 50.0
WALL = {
    "radius_m": 0.04,
    "wall_angle_deg": ALPHA,
    "step_down_m": 0.001,
    "depth_m": 0.002,
    "feed_m_s": 0.05,
    "tilt_frame": "path",
}
TILTS = st.tuples(st.floats(-40.0, 40.0), st.floats(-30.0, 80.0), st.floats(-180.0, 180.0))


def keys(lead: float, lean: float, rotation: float = 0.0) -> dict[str, float]:
    return {"lead_deg": lead, "lean_deg": lean, "rotation_deg": rotation}


def axis_of(path: ToolPath) -> np.ndarray:
    """Unit vectors from the tip up the tool, in the part, (n, 3)."""
    return -(PART.rotation.inv() * path.rotations[0]).apply(APPROACH)


def rates(path: ToolPath) -> np.ndarray:
    """Angular velocity of the tool between samples [rad/s], (n - 1, 3)."""
    (held,) = path.rotations
    return (held[1:] * held[:-1].inv()).as_rotvec() / np.diff(path.time)[:, None]


@given(TILTS)
@settings(max_examples=15, deadline=None)
def test_a_tool_keeps_its_angles_to_the_walls_normal_and_to_the_feed_of_a_cone(tilt):
    """a . n = cos(lead) cos(lean) and a . f = sin(lead) on every sample; lean points up the wall."""
    path = Cone(kind="cone", **WALL, **keys(*tilt)).path(PART)
    lead, lean, alpha = np.deg2rad([*tilt[:2], ALPHA])
    x, y, _ = PART.coordinates(path.position[0]).T
    around = np.arctan2(y, x)
    outward = np.column_stack([np.cos(around), np.sin(around), 0.0 * x])
    feed, up = np.column_stack([-np.sin(around), np.cos(around), 0.0 * x]), [0.0, 0.0, 1.0]
    normal = np.cos(alpha) * np.array(up) - np.sin(alpha) * outward
    along_wall = np.sin(alpha) * np.array(up) + np.cos(alpha) * outward
    axis = axis_of(path)
    for direction, expected in (
        (normal, np.cos(lead) * np.cos(lean)),
        (feed, np.sin(lead)),
        (along_wall, np.cos(lead) * np.sin(lean)),
    ):
        np.testing.assert_allclose(np.sum(axis * direction, axis=1), expected, atol=1e-12)
    # Contour after contour the tool comes back: nothing winds up.
    (held,) = path.rotations
    assert (held[-1] * held[0].inv()).magnitude() < 1e-9


def test_a_tool_that_leans_by_the_walls_angle_stands_upright():
    for table, kind in ((Cone, "cone"), (Pyramid, "pyramid")):
        own = table(kind=kind, **WALL, **keys(0.0, ALPHA, 25.0)).path(PART)
        plain = table(kind=kind, **{**WALL, "tilt_frame": "part"}, **keys(0, 0, 25)).path(PART)
        (held,) = (path.rotations[0] for path in (own,))
        assert (held * plain.rotations[0][0].inv()).magnitude().max() < 1e-12


@given(st.floats(-np.pi, np.pi), TILTS, st.floats(-1.0, 1.0))
@settings(max_examples=15, deadline=None)
def test_on_a_line_lead_leans_along_the_feed_and_lean_to_its_right(heading, tilt, slope):
    """Whatever way it runs, and uphill as well: the normal is that of the part."""
    end = 0.2 * np.array([np.cos(heading), np.sin(heading), slope])
    line = Line(
        kind="line",
        points_m=[[0.0, 0.0, 0.0], end.tolist()],
        feed_m_s=0.1,
        tilt_frame="path",
        **keys(*tilt),
    )
    lead, lean = np.deg2rad(tilt[:2])
    feed = np.array([np.cos(heading), np.sin(heading), 0.0])
    right, up = np.cross(feed, [0.0, 0.0, 1.0]), np.array([0.0, 0.0, 1.0])
    expected = np.sin(lead) * feed + np.cos(lead) * (np.sin(lean) * right + np.cos(lean) * up)
    np.testing.assert_allclose(
        axis_of(line.path(PART)), np.tile(expected, (len(line.path(PART).time), 1)), atol=1e-12
    )


def test_a_line_along_x_is_tilted_as_from_the_part():
    along = {"kind": "line", "points_m": [[0, 0, 0], [0.1, 0, 0]], "feed_m_s": 0.1}
    own, plain = (
        Line(**along, tilt_frame=frame, **keys(12.0, -25.0, 40.0)).path(PART)
        for frame in ("path", "part")
    )
    np.testing.assert_allclose(own.pose, plain.pose, rtol=0, atol=1e-14)


@pytest.mark.parametrize("kind", ["pyramid", "iso9283", "line"])
def test_in_corners_the_tool_rests_and_turns_smoothly_as_long_as_it_is_told(kind):
    """Rates stay below those of a smooth step, and accelerations too; between corners it holds."""
    turn = 1.2
    common = {"tilt_frame": "path", "turn_s": turn, "sample_s": 0.01} | keys(15.0, 20.0)
    back_and_forth = [[0.0, 0.0, 0.0], [0.1, 0.0, 0.0], [0.1, 0.0, 0.02], [0.0, 0.0, 0.02]]
    table = {
        "pyramid": lambda frame: Pyramid(kind="pyramid", **{**WALL, **common, **frame}),
        "iso9283": lambda frame: Iso9283(
            kind="iso9283", size_m=0.2, feed_m_s=0.05, **{**common, **frame}
        ),
        "line": lambda frame: Line(
            kind="line", points_m=back_and_forth, feed_m_s=0.1, **{**common, **frame}
        ),
    }[kind]
    path, plain = table({}).path(PART), table({"tilt_frame": "part"}).path(PART)
    corners = {"pyramid": 4 * 2, "iso9283": 12, "line": 1}[kind]
    assert path.time[-1] == pytest.approx(plain.time[-1] + corners * turn)
    resting = np.linalg.norm(np.diff(path.position[0], axis=0), axis=1) < 1e-15
    assert resting.sum() >= corners * turn / 0.01
    rate = rates(path)
    # w = h' (z - a) for a heading h and an axis a that is a tilt off z, which h turns about.
    tilt = np.max(np.arccos(axis_of(path)[:, 2]))
    fastest, most = 1.875 * np.pi / turn, 10.0 / np.sqrt(3.0) * np.pi / turn**2
    size = np.linalg.norm(rate, axis=1)[resting]
    assert size.max() <= 2.0 * np.sin(0.5 * tilt) * fastest
    change = np.linalg.norm(np.diff(rate, axis=0), axis=1)[resting[1:] & resting[:-1]] / 0.01
    assert change.max() <= 2.0 * np.sin(0.5 * tilt) * most + np.sin(tilt) * fastest**2
    # It begins and ends smoothly: no first step of the rate is more than its third derivative's.
    starts = np.flatnonzero(np.diff(resting.astype(int)) == 1) + 1
    jerk = 2.0 * np.sin(0.5 * tilt) * 60.0 * np.pi / turn**3
    assert np.linalg.norm(rate[starts], axis=1).max() <= jerk * 0.01**2
    if kind != "iso9283":
        assert np.abs(rate[~resting]).max() < 1e-9
    assert np.linalg.norm(rate, axis=1).max() <= MAX_TURN_RATE


def circle_csv(folder, orientation=lambda angle: None):
    """A circle about the part's z axis, its quintic start and stop at rest, tilted rows or not."""
    u = np.linspace(0.0, 1.0, 400)
    angle = 2.0 * np.pi * u**3 * (10.0 - 15.0 * u + 6.0 * u**2)
    position = 0.05 * np.column_stack([np.cos(angle), np.sin(angle), 0.0 * u])
    untilted = Rotation.from_matrix([[0.0, 0.0, 1.0], [0.0, 1.0, 0.0], [-1.0, 0.0, 0.0]])
    rows = untilted if orientation(angle) is None else orientation(angle) * untilted
    quaternion = np.broadcast_to(rows.as_quat(), (400, 4))
    file = folder / "circle.csv"
    table = np.column_stack([8.0 * u, position, quaternion])
    write_table(file, ("time", *POSE_COLUMNS), table)
    return file, angle, rows


def test_on_a_circle_of_a_file_the_tool_follows_the_feed(tmp_path):
    file, angle, _ = circle_csv(tmp_path)
    path = CsvPath(kind="csv", file=file, tilt_frame="path", **keys(20.0, 35.0)).path(PART)
    lead, lean = np.deg2rad([20.0, 35.0])
    feed = np.column_stack([-np.sin(angle), np.cos(angle), 0.0 * angle])
    right = np.column_stack([np.cos(angle), np.sin(angle), 0.0 * angle])
    expected = np.sin(lead) * feed + np.cos(lead) * np.sin(lean) * right
    expected[:, 2] = np.cos(lead) * np.cos(lean)
    np.testing.assert_allclose(axis_of(path), expected, atol=1e-5)


def test_a_files_rows_give_the_normal_where_they_turn_the_tool(tmp_path):
    """Rows that lean outwards by 30 degrees as the circle goes: lean is measured from there."""
    tilted = np.deg2rad(30.0)

    def outwards(angle):
        about = np.column_stack([-np.sin(angle), np.cos(angle), 0.0 * angle])
        return Rotation.from_rotvec(tilted * about)

    file, _, rows = circle_csv(tmp_path, outwards)
    path = CsvPath(kind="csv", file=file, tilt_frame="path", **keys(0.0, 12.0)).path(PART)
    normal = -rows.apply(APPROACH)
    np.testing.assert_allclose(
        np.sum(axis_of(path) * normal, axis=1), np.cos(np.deg2rad(12.0)), atol=1e-12
    )
    # Right of the feed is outwards here: both leans add up.
    np.testing.assert_allclose(axis_of(path)[:, 2], np.cos(tilted + np.deg2rad(12.0)), atol=1e-5)


def test_a_corner_of_a_file_in_which_the_tool_rests_is_turned_in_there(tmp_path):
    def smooth(u):
        return u**3 * (10.0 - 15.0 * u + 6.0 * u**2)

    u = np.linspace(0.0, 1.0, 101)
    there = np.column_stack([0.1 * smooth(u), 0.0 * u, 0.0 * u])
    aside = np.column_stack([0.1 + 0.0 * u, 0.1 * smooth(u), 0.0 * u])
    file = tmp_path / "corner.csv"
    for rest, refused in ((2.0, False), (0.05, True)):
        position = np.vstack([there, np.tile(there[-1], (9, 1)), aside])
        time = np.concatenate([2.0 * u, 2.0 + rest * np.arange(1, 10) / 10.0, 2.0 + rest + 2.0 * u])
        upright = np.tile([0.0, np.sqrt(0.5), 0.0, np.sqrt(0.5)], (len(time), 1))
        write_table(file, ("time", *POSE_COLUMNS), np.column_stack([time, position, upright]))
        table = CsvPath(kind="csv", file=file, tilt_frame="path", **keys(60.0, 0.0))
        if refused:
            with pytest.raises(
                CaseError, match=r"turns its tool by at most 180 deg/s, got .* at 2"
            ):
                table.path(PART)
            continue
        axis = axis_of(table.path(PART))
        np.testing.assert_allclose(axis[50], [np.sin(np.pi / 3), 0.0, 0.5], atol=1e-9)
        np.testing.assert_allclose(axis[160], [0.0, np.sin(np.pi / 3), 0.5], atol=1e-9)
        np.testing.assert_allclose(axis[:, 2], 0.5, atol=1e-12)


def test_the_sphere_of_a_turning_tool_goes_where_that_of_the_upright_one_does():
    """The TCP is its centre: a radius above the path of the upright tool's tip, seen from the part."""
    short = {"depth_m": 0.001}
    plain = example("cone", tool_path=short)
    turning = example("cone", tool_path=short | {"tilt_frame": "path"} | keys(5.0, 20.0, 30.0))
    radius = 0.005
    above = turning.desired.position - plain.desired.position
    # Both are asked where they cross the sheet's plane, to the nanosecond.
    np.testing.assert_allclose(above[0], np.tile([0, 0, radius], (len(above[0]), 1)), atol=1e-10)
    for own, back in ((plain, 0.0), (turning, radius)):
        robot = own.robots[0].description
        tip = np.array(plain.robots[0].description.tcp_position)
        approach = Rotation.from_euler("xyz", robot.tcp_rpy).apply(APPROACH)
        np.testing.assert_allclose(robot.tcp_position, tip - back * approach, atol=1e-15)
    lean = example("cone", tool_path=short | {"tilt_frame": "path"} | keys(0.0, 45.0))
    np.testing.assert_array_equal(lean.desired.position, plain.desired.position)


@pytest.mark.parametrize(
    ("name", "changes"),
    [
        ("cone", {}),
        ("cone_fem", {"process": {"element_m": 0.008, "position_m": 0.02}}),
        ("two_robots", {}),
    ],
)
def test_forces_do_not_know_how_a_sphere_is_held_as_it_turns(name, changes):
    """The force law's, the computed sheet's to rounding, and those of a supporting tool."""
    short = {"depth_m": 0.001, "radius_m": 0.03, "tilt_frame": "path"}
    upright, turning = (
        example(name, tool_path=short | tilt, **changes)
        for tilt in (keys(0.0, 45.0), keys(8.0, 20.0, 30.0))
    )
    assert turning.task.height > 0.0
    assert upright.task.height == 0.0
    forces = [case.process.evaluate(case.desired).wrench.force for case in (upright, turning)]
    assert np.abs(forces[0]).max() > 50.0
    np.testing.assert_allclose(forces[1], forces[0], rtol=0, atol=1e-5)
    if upright.task.support is not None:
        paths = [case.desired.pose[1] for case in (upright, turning)]
        np.testing.assert_allclose(*paths, rtol=0, atol=1e-8)


FOLLOWING = {"depth_m": 0.0005, "radius_m": 0.03, "tilt_frame": "path"} | keys(6.0, 25.0)


def test_the_command_of_a_tool_that_follows_its_path_takes_it_there():
    run = run_compensation(example("cone", tool_path=FOLLOWING))
    assert run.correction.converged
    assert measure(run.correction.achieved, run.desired).maximum < 5e-6
    assert measure(run.before, run.desired).maximum > 1e-3
    (achieved,), (desired,) = (own.rotations for own in (run.correction.achieved, run.desired))
    assert (achieved * desired.inv()).magnitude().max() < 1e-3


def test_the_python_and_the_native_robot_follow_alike():
    found, small = [], FOLLOWING | {"radius_m": 0.01}
    for kind in ("native", "python"):
        case = example("cone", tool_path=small, robot={"fmu": kind, "mode": "quasistatic"})
        with FmuPool(kind) as models:
            cell, _ = cell_of(case.robots, models)
            found.append(Uncorrected().correct(case.loop(cell), case.motion).achieved.pose)
    np.testing.assert_allclose(*found, rtol=0, atol=1e-8)


def test_an_ssp_of_a_turning_tool_has_the_law_of_its_sphere(tmp_path):
    """In its process FMU the depth is that of the sphere's lowest point."""
    case = example("cone", tool_path=FOLLOWING)
    with zipfile.ZipFile(SspSystem.of(case).write(tmp_path / "cone.ssp", ["linux64"])) as system:
        inner = io.BytesIO(system.read("resources/Process.fmu"))
    with zipfile.ZipFile(inner) as fmu:
        law = json.loads(fmu.read("resources/law.json"))
    origin = np.array(law["constants"]["part_position"])
    np.testing.assert_allclose(origin - case.task.part.position, [0, 0, 0.005], atol=1e-15)


@pytest.mark.parametrize(
    ("tables", "words"),
    [
        ({"tilt_frame": "world"}, "tilt_frame: expected 'part' or 'path', got 'world'"),
        (
            {"tilt_frame": "path", "lean_deg": -50.0},
            "lean_deg: expected more than -45 from the wall",
        ),
        ({"tilt_frame": "path", "turn_s": 0.0}, "turn_s: expected a number greater than 0"),
        (
            {"kind": "pyramid", "tilt_frame": "path", "turn_s": 0.1},
            "tool_path: tilt_frame: expected a path that turns its tool by at most 180 deg/s, got",
        ),
    ],
)
def test_what_cannot_be_followed_is_refused_in_a_sentence(tables, words):
    with pytest.raises(CaseError, match=words):
        example("cone", tool_path=tables)


def test_a_path_without_a_feed_across_the_tool_is_refused(tmp_path):
    words = "tilt_frame: expected a path with a feed across the tool's axis of approach, got one"
    down = Line(kind="line", points_m=[[0, 0, 0.1], [0, 0, 0.0]], feed_m_s=0.1, tilt_frame="path")
    with pytest.raises(CaseError, match=words):
        down.path(PART)
    file = tmp_path / "down.csv"
    time = np.linspace(0.0, 1.0, 30)
    depth = -0.1 * time**3 * (10.0 - 15.0 * time + 6.0 * time**2)
    upright = np.tile([0.0, np.sqrt(0.5), 0.0, np.sqrt(0.5)], (30, 1))
    rows = np.column_stack([time, 0.0 * time, 0.0 * time, depth, upright])
    write_table(file, ("time", *POSE_COLUMNS), rows)
    with pytest.raises(CaseError, match=words):
        CsvPath(kind="csv", file=file, tilt_frame="path").path(PART)
