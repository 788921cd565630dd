"""Frames in each other, against homogeneous matrices; ends of a path in motion."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from scipy.spatial.transform import Rotation

from coupling.path.frame import AT_THE_ORIGIN, Frame, lengths, turned, turns_between
from coupling.path.histories import ToolPath
from coupling.path.path_ends import ends_in_motion, is_near_moving_end

SEEDS = st.integers(0, 10**6)
# Quaternions have their last bit; a turn's vector is twice it, and pi long at most.
ROUNDING = 1e-14


def random_frame(rng: np.random.Generator) -> Frame:
    return Frame(rng.normal(size=3), Rotation.random(random_state=rng.integers(2**31)))


def matrix(frame: Frame) -> np.ndarray:
    """The homogeneous transformation, 4 x 4."""
    upper = np.column_stack([frame.rotation.as_matrix(), frame.position])
    return np.vstack([upper, [0.0, 0.0, 0.0, 1.0]])


def assert_same(found: np.ndarray, expected: np.ndarray) -> None:
    np.testing.assert_allclose(found, expected, rtol=0, atol=1e-12)


@given(SEEDS)
def test_frames_multiply_and_invert_as_homogeneous_matrices(seed):
    rng = np.random.default_rng(seed)
    a_from_b, b_from_c = random_frame(rng), random_frame(rng)
    assert_same(matrix(a_from_b @ b_from_c), matrix(a_from_b) @ matrix(b_from_c))
    assert_same(matrix(a_from_b.inverse()), np.linalg.inv(matrix(a_from_b)))
    assert_same(matrix(Frame.of_pose(a_from_b.pose)), matrix(a_from_b))
    assert a_from_b.pose[6] >= 0.0
    points = rng.normal(size=(2, 4, 3))
    expected = (matrix(a_from_b) @ np.append(points[1, 2], 1.0))[:3]
    assert_same(a_from_b.points(points)[1, 2], expected)
    assert_same(a_from_b.coordinates(a_from_b.points(points)), points)


@pytest.mark.filterwarnings("ignore:Optimal rotation is not uniquely")
@given(SEEDS)
def test_the_frame_of_the_nearest_points_is_the_one_that_they_were_told_in(seed):
    rng = np.random.default_rng(seed)
    frame, points = random_frame(rng), rng.normal(size=(5, 3))
    assert_same(matrix(Frame.fitted(points, frame.points(points))), matrix(frame))
    alone = Frame.fitted(points[:1], frame.points(points[:1]))
    assert alone.rotation.magnitude() == 0.0
    for count in (1, 2):  # two leave a turn about their line open
        some = Frame.fitted(points[:count], frame.points(points[:count]))
        assert_same(some.points(points[:count]), frame.points(points[:count]))


def test_a_frame_that_is_moved_or_turned_is_not_at_the_origin():
    assert AT_THE_ORIGIN.is_at_the_origin
    for shift in 1e-6 * np.eye(6):
        assert not Frame.of_rpy(shift[:3], shift[3:]).is_at_the_origin


_TIME = np.linspace(0.0, 10.0, 201)
_SMOOTH = (
    _TIME**3 * (10.0 * 20.0**2 - 15.0 * 20.0 * _TIME + 6.0 * _TIME**2) / 20.0**5
)  # half of a ramp


def _path(x: np.ndarray) -> ToolPath:
    pose = np.zeros((len(x), 7))
    pose[:, 0], pose[:, 6] = x, 1.0
    return ToolPath(_TIME, pose)


@pytest.mark.parametrize(
    ("x", "verbs"),
    [
        (0.05 * _TIME, ["begins at 0.05 m/s", "ends at 0.05 m/s"]),
        (_SMOOTH, ["ends at"]),
        (_SMOOTH[::-1], ["begins at"]),
        (_TIME**3 * (10.0 - _TIME) ** 3, []),
        (np.zeros(201), []),
    ],
)
def test_every_end_in_motion_is_told(x, verbs):
    told = ends_in_motion(_path(x), ("forming",))
    assert len(told) == len(verbs)
    assert all(verb in text for verb, text in zip(verbs, told, strict=True))


def test_only_what_is_near_such_an_end_is_explained_by_it():
    starts = _path(_SMOOTH[::-1])
    assert [is_near_moving_end(starts, time) for time in (0.01, 5.0, 9.99)] == [True, False, False]


@pytest.mark.parametrize("angle", [0.0, 1e-12, 1e-6, 0.3, 3.0], ids="{:g} rad".format)
def test_turns_are_those_of_rotations(angle):
    draw = np.random.default_rng(7)
    axes = draw.standard_normal((2, 50, 3))
    turn = angle * axes / np.linalg.norm(axes, axis=-1, keepdims=True)
    orientation = Rotation.random(50, rng=8)
    further = turned(orientation.as_quat(), turn)
    for k in range(2):
        expected = (Rotation.from_rotvec(turn[k]) * orientation).as_quat()
        expected *= np.where(expected[:, 3:] < 0.0, -1.0, 1.0)
        np.testing.assert_allclose(further[k], expected, atol=ROUNDING)
        # The opposite quaternion is the same orientation.
        back = turns_between(-orientation.as_quat(), further[k])
        np.testing.assert_allclose(back, turn[k], atol=ROUNDING)


def test_lengths_are_norms():
    vectors = np.random.default_rng(9).standard_normal((3, 20, 4))
    np.testing.assert_allclose(lengths(vectors), np.linalg.norm(vectors, axis=-1), rtol=ROUNDING)
