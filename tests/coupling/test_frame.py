"""Frames: points, paths, wrenches and springs seen from another one."""

from __future__ import annotations

import numpy as np
from hypothesis import given
from hypothesis import strategies as st
from scipy.spatial.transform import Rotation

from coupling.path.contact_spring import ContactSpring
from coupling.path.frame import Frame
from coupling.path.histories import ToolPath, WrenchHistory, poses

TIME = np.array([0.0, 0.5, 1.0, 2.0])
SEEDS = st.integers(0, 10**6)


def random_frame(rng: np.random.Generator) -> Frame:
    return Frame(rng.normal(size=3), Rotation.random(random_state=rng.integers(2**31)))


def random_path(rng: np.random.Generator) -> ToolPath:
    turned = Rotation.random(len(TIME), random_state=rng.integers(2**31))
    return ToolPath(TIME, poses(rng.normal(size=(len(TIME), 3)), turned))


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


@given(SEEDS)
def test_the_frame_of_the_nearest_points_is_the_one_that_they_were_told_in(seed):
    rng = np.random.default_rng(seed)
    frame, points = random_frame(rng), rng.normal(size=(5, 3))
    assert_same(matrix(Frame.fitted(points, frame.points(points))), matrix(frame))
    alone = Frame.fitted(points[:1], frame.points(points[:1]))
    assert alone.rotation.magnitude() == 0.0
    assert_same(alone.points(points[0]), frame.points(points[0]))


@given(SEEDS)
def test_a_wrench_and_its_spring_do_the_same_work_in_all_frames(seed):
    """A load in world axes does on motions in the world what its image does in the base."""
    rng = np.random.default_rng(seed)
    world_from_base, path = random_frame(rng), random_path(rng)
    base_from_world = world_from_base.inverse()
    assert_same(path.transformed(world_from_base).transformed(base_from_world).pose, path.pose)
    root = rng.normal(size=(1, len(TIME), 3, 3))
    spring = ContactSpring(rng.normal(size=(1, len(TIME), 3)), root @ root.swapaxes(-1, -2))
    wrench = WrenchHistory(TIME, rng.normal(size=(len(TIME), 6)), spring)
    moved = path.displaced(1e-6 * rng.normal(size=(1, len(TIME), 6)))
    in_world = [own.transformed(world_from_base) for own in (path, moved)]
    loads = wrench.on(in_world[0])
    image = wrench.transformed(base_from_world).on(path)
    work = np.sum(loads.wrench * in_world[1].deviation_from(in_world[0]), axis=2)
    own = np.sum(image.wrench * moved.deviation_from(path), axis=2)
    np.testing.assert_allclose(own, work, rtol=0, atol=1e-13)
