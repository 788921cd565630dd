"""A low-pass of zero phase whose gain is known, also at its ends and at uneven samples."""

from __future__ import annotations

import numpy as np
import pytest

from coupling.identification.next.smoother import Smoother

TIME = np.linspace(0.0, 20.0, 4001)  # [s]


@pytest.mark.parametrize("frequency", [0.5, 1.6, 2.0, 2.6, 4.0])
def test_a_wave_is_left_with_the_gain_and_no_delay(frequency):
    """1 / (1 + (sin(pi f h) / sin(pi f_c h))^8): half at the cutoff; of a cosine no sine is left."""
    kept = Smoother(TIME, 2.0)
    slow = kept(np.cos(2.0 * np.pi * frequency * TIME)[:, None])[:, 0]
    inner = (kept.time > 5.0) & (kept.time < 15.0)
    phase = 2.0 * np.pi * frequency * kept.time[inner]
    both = np.stack([np.cos(phase), np.sin(phase)], axis=1)
    gain, delayed = np.linalg.lstsq(both, slow[inner], rcond=None)[0]
    ratio = np.sin(np.pi * frequency * kept.spacing) / np.sin(np.pi * 2.0 * kept.spacing)
    assert gain == pytest.approx(1.0 / (1.0 + ratio**8), abs=0.01)
    assert kept.gain(np.array(frequency)) == pytest.approx(1.0 / (1.0 + ratio**8), rel=1e-12)
    assert abs(delayed) < 1e-3


def test_a_cubic_is_kept_to_its_ends_with_uneven_samples_and_a_hole():
    """Its fourth differences are zero: nothing is taken off but by straight lines between nodes."""
    rng = np.random.default_rng(3)
    time = np.sort(rng.uniform(0.0, 10.0, 1500))
    time = time[(time < 4.0) | (time > 4.6)]

    def cubic(at: np.ndarray) -> np.ndarray:
        return 1e-4 * np.stack([1.0 - at + 0.2 * at**2, 0.01 * at**3], axis=1)

    kept = Smoother(time, 1.0)
    straight = 1e-4 * 0.06 * 10.0 * kept.spacing**2 / 8.0  # largest second derivative times h^2 / 8
    off = np.abs(kept(cubic(time)) - cubic(kept.time))
    assert off.max() < 3.0 * (straight + 1e-4 * 0.4 * kept.spacing**2 / 8.0)


def test_noise_is_left_as_told_and_what_is_taken_off_the_signal_is_found_under_it():
    """Mean squares over 400 columns; a wave of 3 Hz, of which a cutoff of 2 Hz takes nearly all."""
    noise = 2e-5
    white = noise * np.random.default_rng(1).standard_normal((len(TIME), 400))
    kept, seen = Smoother(TIME, 2.0), Smoother(TIME, 15.0)
    inner = (kept.time > 1.0) & (kept.time < 19.0)
    assert np.mean(kept(white)[inner] ** 2) == pytest.approx(noise**2 * kept.of_noise, rel=0.03)
    wave = 3e-5 * np.sin(6.0 * np.pi * TIME)[:, None]
    taken = 0.5 * 3e-5**2 * (1.0 - kept.gain(np.array(3.0))) ** 2
    found = kept.bias(wave + white, noise, seen) / 400.0
    assert found == pytest.approx(taken, rel=0.02)


def test_what_is_sampled_too_seldom_for_the_cutoff_is_not_smoothed_by_chance():
    """A cutoff above half the samples' rate leaves the samples nearly as they are."""
    time = np.linspace(0.0, 10.0, 101)
    values = np.random.default_rng(2).standard_normal((101, 1))
    kept = Smoother(time, 20.0)
    assert np.abs(kept.at_samples(kept(values)) - values).max() < 0.1
