"""Lengths and turns of many rows are those of NumPy's norm and SciPy's rotations."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from coupling.path.vectors import lengths, turned, turns_between

# Quaternions have their last bit; a turn's vector is twice it, and pi long at most.
ROUNDING = 1e-14


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
