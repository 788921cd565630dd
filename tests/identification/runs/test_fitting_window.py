"""How far along a run a fit looks."""

import numpy as np
import pytest

from coupling.identification.runs.fit import fitting_window
from coupling.identification.runs.slow_part import SlowPart

TIME = np.arange(0.0, 10.0, 0.004)
MEAN = SlowPart.of(TIME)
NOISE = 4e-6


def left(since: float, until: float = np.inf) -> np.ndarray:
    """Ten times noise from one time to another, else as much as noise."""
    size = np.where((MEAN.time >= since) & (MEAN.time < until), 10.0 * NOISE, NOISE)
    return np.outer(size, [0.6, 0.0, 0.8])


def test_a_fit_looks_half_a_second_beyond_what_it_explains():
    assert fitting_window([left(4.0)], [MEAN], NOISE, 1.0) == pytest.approx(4.5, abs=0.12)


def test_a_fit_looks_further_where_what_it_looked_at_stays_unexplained():
    """Unexplained from 2 to 3 s: looked at before, it does not keep the fit from what follows."""
    unexplained = left(2.0, 3.0)
    assert fitting_window([unexplained], [MEAN], NOISE, 2.4) == pytest.approx(2.9, abs=0.05)
    assert fitting_window([unexplained], [MEAN], NOISE, 3.2) == np.inf


def test_strides_grow_where_a_fit_explains_nothing():
    """By a fifth of what was looked at: as where a gear is in its backlash without load all along."""
    assert fitting_window([left(0.0)], [MEAN], NOISE, 4.0, explained=False) == pytest.approx(4.8)
    assert fitting_window([left(0.0)], [MEAN], NOISE, 9.0, explained=False) == np.inf


def test_a_fit_that_explains_all_looks_at_all():
    assert fitting_window([left(np.inf)], [MEAN], NOISE, 0.0) == np.inf
    assert fitting_window([left(9.9)], [MEAN], NOISE, 0.0) == np.inf


def test_of_several_passes_the_one_explained_least_tells_how_far_to_look():
    found = fitting_window([left(np.inf), left(3.0)], [MEAN, MEAN], NOISE, 0.0)
    assert found == pytest.approx(3.5, abs=0.12)


def test_a_fit_begins_with_the_first_second():
    assert fitting_window([left(0.0)], [MEAN], NOISE, 0.0) == 1.0
