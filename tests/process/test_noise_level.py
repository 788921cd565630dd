"""Noise and the teeth's ripple of a history are told apart from its smooth course."""

import numpy as np
import pytest

from coupling.path.deviation import DeviationParts
from coupling.process.noise import noise_level


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


TIME = np.linspace(0.0, 0.1, 1001)  # samples of 0.1 ms


@pytest.mark.parametrize("period", [1.5e-3, 7.5e-4])
def test_the_teeth_are_ripple_and_what_is_slower_is_slow(period):
    """A straight rise and a sine of the teeth in three axes; chords of 0.1 ms at 7.5 a period."""
    slope, size = np.array([3e-3, 0.0, -1e-3]), np.array([1e-6, 2e-6, 0.0])
    rise = TIME[:, None] * slope
    ripple = np.sin(2.0 * np.pi * TIME / period)[:, None] * size
    inside = slice(20, -20)
    parts = DeviationParts.of(TIME, rise + ripple, period)
    np.testing.assert_allclose(parts.slow[inside], rise[inside], atol=0.02e-6)
    np.testing.assert_allclose(parts.ripple[inside], ripple[inside], atol=0.02e-6)


def test_the_walls_are_what_is_reached_within_a_period():
    """A single excursion of one sample reaches half a period to either side of it."""
    off = np.zeros(len(TIME))
    off[500] = 1e-6
    parts = DeviationParts.of(TIME, off, 1.5e-3)
    reached = np.flatnonzero(parts.highest)
    assert (reached[0], reached[-1]) == (500 - 7, 500 + 7)
    assert not parts.lowest.any()
    assert parts.slow.sum() == pytest.approx(1e-6)  # a mean moves nothing away
