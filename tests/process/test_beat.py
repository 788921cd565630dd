"""Parts of a deviation under a mill: each is what it says, at tooth periods that no sample divides."""

from __future__ import annotations

import numpy as np
import pytest

from coupling.path.deviation_parts import DeviationParts

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
