"""The noise of a history is told apart from its smooth course."""

from __future__ import annotations

import numpy as np
import pytest

from coupling.process.smoothing import noise_level


def cone_force(time: np.ndarray) -> np.ndarray:
    """Return a force of 300 N that circles once in 7.5 s, in and out by ramps of 2 s, (n, 3) [N]."""
    angle = 2.0 * np.pi * time / 7.5
    ramp = np.clip(np.minimum(time, time[-1] - time) / 2.0, 0.0, 1.0)
    course = np.column_stack([0.4 * np.cos(angle), 0.4 * np.sin(angle), np.full(time.shape, 0.9)])
    return 300.0 * ramp[:, None] * course


STEPS = {
    "even": np.linspace(0.0, 100.0, 5001),
    "uneven": np.sort(np.random.default_rng(3).uniform(0.0, 100.0, 5001)),
    "a log": np.cumsum(np.tile([0.004, 0.02, 0.02, 0.016], 1250)),
}


@pytest.mark.parametrize("steps", STEPS)
@pytest.mark.parametrize("sigma", [5.0, 15.0, 50.0])
def test_the_standard_deviation_of_white_noise_is_found(steps, sigma):
    time = STEPS[steps]
    force = cone_force(time)
    noisy = force + np.random.default_rng(7).normal(0.0, sigma, force.shape)
    np.testing.assert_allclose(noise_level(time, noisy), sigma, rtol=0.1)


def test_smooth_forces_have_none():
    time = np.arange(0.0, 150.0, 0.02)
    assert np.all(noise_level(time, cone_force(time)) < 1e-5 * 300.0)


def test_each_column_has_its_own():
    time = STEPS["even"]
    noise = np.random.default_rng(2).normal(0.0, 1.0, (len(time), 2)) * [1.0, 20.0]
    found = noise_level(time, noise)
    assert found.shape == (2,)
    np.testing.assert_allclose(found, [1.0, 20.0], rtol=0.1)
    assert noise_level(time, noise[:, 1]) == pytest.approx(found[1], rel=1e-12)


def test_jumps_are_no_noise():
    """Ten of 300 N, in 5001 samples: noise of 5 N stays that, and a smooth force without."""
    time = STEPS["even"]
    jumps = 300.0 * (np.floor(time / 10.0) % 2.0)
    assert noise_level(time, jumps) < 1e-9
    noisy = jumps + np.random.default_rng(5).normal(0.0, 5.0, time.shape)
    assert noise_level(time, noisy) == pytest.approx(5.0, rel=0.1)


def test_a_parabola_has_none_whatever_its_steps():
    time = STEPS["uneven"]
    assert noise_level(time, 3.0 - 2.0 * time + 0.5 * time**2) < 1e-6


def test_three_samples_tell_nothing():
    assert noise_level(np.arange(3.0), np.ones((3, 2))).tolist() == [0.0, 0.0]
