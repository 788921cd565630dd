"""The desired motion is a function of time: samples choose where a process is asked, no more."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from scipy.spatial.transform import Rotation

from coupling.errors import CaseError
from coupling.path.frame import Frame
from coupling.path.histories import ToolPath
from coupling.path.interpolation import InterpolatedPath
from coupling.process.corners import crossings, level_crossings
from coupling.toolpaths import TOOL_PATHS
from coupling.toolpaths.instants import MAX_STEP, PathTimes, insert_corners
from coupling.toolpaths.motion import follow
from coupling.toolpaths.segments import polyline

FLAT = Frame(np.array([1.6, 0.0, 0.8]), Rotation.from_euler("xyz", [0.1, 0.2, 0.3]))
CONTOURS = {
    "radius_m": 0.03,
    "wall_angle_deg": 60.0,
    "step_down_m": 0.001,
    "depth_m": 0.0035,
    "feed_m_s": 0.047,
}
PATHS = {
    "cone": CONTOURS,
    "pyramid": CONTOURS | {"blend_s": 0.13},
    "iso9283": {"size_m": 0.5, "feed_m_s": 0.07},
    "line": {"points_m": [[0, 0, 0.01], [0.1, 0, 0], [0.1, 0.07, -0.01]], "feed_m_s": 0.033},
}
GCODE = "G21 G90 G0 X0 Y0 Z0\nG1 X30 F1700\nG4 P0.333\nG3 X30 Y21 J10.5\nG1 X3 Y1\n"


def made(kind, tmp_path, **more):
    keys = PATHS.get(kind)
    if kind == "gcode":
        keys = {"file": tmp_path / "path.ngc"}
        keys["file"].write_text(GCODE)
    return TOOL_PATHS[kind](kind=kind, **keys, **more)


FOLLOWED = {"tilt_frame": "path", "lean_deg": 20.0}


@pytest.mark.parametrize(
    ("kind", "turned"),
    [*((kind, FOLLOWED) for kind in PATHS), *((k, {}) for k in (*PATHS, "gcode"))],
)
def test_a_path_is_the_same_motion_at_any_sampling(kind, turned, tmp_path):
    """Rows in between, told by others: within a nanometre; a duration to rounding."""
    one = made(kind, tmp_path, sample_s=0.02, **turned).task(FLAT)
    for other in (made(kind, tmp_path, sample_s=s, **turned).task(FLAT) for s in (0.0031, 0.11)):
        time = other.forming.time
        assert time[-1] == pytest.approx(one.forming.time[-1], rel=1e-14)
        seen = InterpolatedPath(one.forming).at(time.clip(max=one.forming.time[-1]))
        assert other.forming.distance_to(seen).max() < 2e-9
        turn = (other.forming.rotations[0] * seen.rotations[0].inv()).magnitude()
        assert turn.max() < 2e-6


@pytest.mark.parametrize("kind", PATHS)
def test_a_process_is_asked_at_rests_and_as_often_as_wanted(kind, tmp_path):
    task = made(kind, tmp_path, sample_s=0.02).task(FLAT)
    asked, speed = task.sampled.forming, InterpolatedPath(task.forming).position
    assert np.diff(asked.time).max() <= 0.02 * (1.0 + 1e-9)
    assert np.diff(task.forming.time).max() <= MAX_STEP * (1.0 + 1e-9)
    size = np.linalg.norm(speed(task.forming.time, 1), axis=1)
    rests = (
        np.flatnonzero((size[1:-1] < 1e-6) & (size[1:-1] <= np.minimum(size[:-2], size[2:]))) + 1
    )
    assert len(rests) >= 1
    assert np.isin(task.forming.time[rests], asked.time).mean() > 0.9


@given(
    st.lists(st.floats(0.05, 2.0), min_size=1, max_size=5),
    st.floats(1e-4, 0.3),
    st.lists(st.floats(-0.1, 11.0), max_size=6),
)
def test_instants_keep_what_they_promise(durations, period, corners):
    rests = np.cumsum(durations)
    instants = PathTimes.of(rests, period, np.array(corners))
    asked = instants.time[instants.sample_rows]
    assert asked[0] == 0.0
    assert asked[-1] == rests[-1]
    assert np.isin(rests, asked).all()
    assert np.diff(asked).min() > 0.0
    assert np.diff(asked).max() <= period * (1.0 + 1e-9)
    assert np.diff(instants.time).max() <= min(period, MAX_STEP) * (1.0 + 1e-9)
    for corner in corners:
        if 0.0 < corner < rests[-1]:
            assert np.abs(asked - corner).min() <= max(0.1 * period, MAX_STEP / 3.0)


def test_corners_that_stand_free_are_instants():
    instants = PathTimes.of(np.array([1.0]), 0.02, np.array([0.333, 0.7, 0.7005]))
    asked = instants.time[instants.sample_rows]
    assert np.isin([0.333, 0.7], asked).all()
    assert 0.7005 not in asked


def test_a_path_of_more_samples_than_fit_is_refused(tmp_path):
    with pytest.raises(CaseError, match="sample_s"):
        made("cone", tmp_path, sample_s=1e-6).task(FLAT)


def test_motions_follow_one_another():
    """0.1 m at 0.1 m/s with blends of 0.2 s takes 1.2 s; each corner is a rest."""
    motion = follow(polyline(np.array([[0.0, 0, 0], [0.1, 0, 0], [0.2, 0, 0]])), 0.1, 0.2)
    np.testing.assert_allclose(motion.travel.rests, [1.2, 2.4], rtol=1e-15)
    found = motion.at(np.array([0.0, 0.6, 1.2, 1.8, 2.4]))[:, 0]
    np.testing.assert_allclose(found, [0.0, 0.05, 0.1, 0.15, 0.2], atol=1e-15)
    np.testing.assert_allclose(motion.at(np.array([0.6, 1.8]))[:, 0], [0.05, 0.15], atol=1e-15)


def test_headings_turn_the_shorter_way_in_corners_and_are_kept_by_links():
    corners = polyline(np.array([[0, 0, 0], [0.1, 0, 0], [0.1, 0.1, 0], [0.0, 0.1, 0.0]], float))
    motion = follow(corners, 0.1, 0.1, turn=0.4)
    rests = motion.travel.rests
    heading = motion.at(np.linspace(0.0, rests[-1], 4001))[:, 3]
    np.testing.assert_allclose([heading[0], heading[-1]], [0.0, np.pi], atol=1e-12)
    assert np.diff(heading).min() >= 0.0
    np.testing.assert_allclose(np.diff(rests), [0.4, 1.1, 0.4, 1.1], rtol=1e-12)


def lifted(height):
    time = np.linspace(0.0, 2.0, 101)
    pose = np.zeros((len(time), 7))
    pose[:, 0], pose[:, 2], pose[:, 6] = 0.1 * time, height(time), 1.0
    return ToolPath(time, pose)


def test_levels_are_crossed_when_they_are():
    """z = 0.01 cos(pi t): 0 at 0.5 and 1.5 s, -5 mm at 2/3 and 4/3 s; touching from above is none."""
    path = lifted(lambda t: 0.01 * np.cos(np.pi * t))
    at = level_crossings(path, Frame(np.zeros(3), Rotation.identity()), (0.0, -0.005, -0.01, 0.02))
    np.testing.assert_allclose(at, [0.5, 2.0 / 3.0, 4.0 / 3.0, 1.5], atol=2e-7)


@pytest.mark.parametrize("sample", [0.02, 0.005])
def test_a_rest_on_a_surface_is_one_sample_and_no_other_is_beside_it(sample):
    """The line rests at the sheet's plane and goes on into it: a corner of the force, and a rest."""
    points = [[0.0, 0.0, 0.01], [0.05, 0.0, 0.0], [0.1, 0.0, -0.01]]
    line = TOOL_PATHS["line"](kind="line", points_m=points, feed_m_s=0.05, sample_s=sample)
    path = line.task(FLAT).forming
    found = level_crossings(path, FLAT, (0.0,))
    rest = 0.5 * path.time[-1]
    asked = line.task(FLAT, found).sampled.forming.time
    np.testing.assert_allclose(np.diff(asked), rest / np.ceil(rest / sample), rtol=1e-9)


def test_a_row_on_a_surface_is_when_it_is_crossed():
    path = lifted(lambda t: 0.01 * (1.0 - t))
    (found,) = crossings(path, lambda position: position[:, 2])
    assert found == 1.0


def test_a_path_from_a_file_keeps_its_rows_and_gets_corners_beside_them():
    path = lifted(lambda t: 0.01 * np.cos(np.pi * t))
    longer, asked = insert_corners(path, np.array([-1.0, 0.333, 0.5001, 0.99, 2.0]))
    np.testing.assert_array_equal(asked, np.arange(103))
    assert np.isin(path.time, longer.time).all()
    assert np.isin([0.333, 0.5001, 0.99], longer.time).tolist() == [True, False, True]
    np.testing.assert_array_equal(
        longer.pose[:, np.searchsorted(longer.time, path.time)], path.pose
    )
