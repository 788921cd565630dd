"""The robot as data."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from random_robots import robots
from scipy.spatial.transform import Rotation

from elastic_robot.body import Body
from elastic_robot.description import Robot


@given(robots())
def test_json_round_trip_is_exact(robot: Robot):
    assert Robot.from_json(robot.to_json()) == robot


@given(st.integers(0, 10**6))
def test_a_body_placed_in_another_frame_has_the_energy_it_had(seed):
    """Kinetic energy of a rotation about the frame's origin, written in either frame."""
    rng = np.random.default_rng(seed)
    turn, shift = Rotation.random(rng=rng).as_matrix(), rng.normal(size=3)
    square = rng.normal(size=(3, 3))
    second_moments = square @ square.T
    inertia = np.trace(second_moments) * np.eye(3) - second_moments
    body = Body.from_matrix(3.0, rng.normal(size=3), inertia)
    placed, spin = body.placed(turn, shift), rng.normal(size=3)

    def energy(of: Body, spin: np.ndarray, origin: np.ndarray) -> float:
        velocity = np.cross(spin, np.array(of.com) - origin)
        return 0.5 * of.mass * velocity @ velocity + 0.5 * spin @ of.inertia_matrix @ spin

    found, expected = energy(placed, turn @ spin, shift), energy(body, spin, np.zeros(3))
    assert found == pytest.approx(expected, rel=1e-12)
    assert energy(body.scaled(2.0), spin, np.zeros(3)) == pytest.approx(2.0 * expected, rel=1e-12)
