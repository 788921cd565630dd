"""Rows of a path that show it: what lies between them is within a tolerance."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from hypothesis.extra.numpy import arrays

from coupling.report.thinning import rows_within

NUMBERS = st.floats(-1e3, 1e3)


@settings(max_examples=60, deadline=None)
@given(
    arrays(float, st.tuples(st.integers(2, 60), st.integers(1, 3)), elements=NUMBERS),
    st.floats(1e-3, 1e3),
)
def test_straight_lines_between_the_rows_stay_within_the_tolerance(values, tolerance):
    time = np.cumsum(np.linspace(0.1, 1.0, len(values)))
    rows = rows_within(time, values, np.full(values.shape[1], tolerance), len(values))
    assert rows[0] == 0
    assert rows[-1] == len(values) - 1
    for column in values.T:
        error = np.abs(column - np.interp(time, time[rows], column[rows]))
        assert error.max() <= tolerance * (1.0 + 1e-9) + 1e-9


def test_a_peak_of_one_sample_is_kept_where_rows_are_few():
    """Ten minutes of noise, and one sample that is a thousand times larger."""
    time = np.linspace(0.0, 600.0, 20_001)
    values = np.random.default_rng(1).normal(size=(len(time), 1))
    values[7_654] = 1e3
    rows = rows_within(time, values, np.array([1e-3]), 500)
    assert len(rows) <= 500
    assert 7_654 in rows


@pytest.mark.parametrize("count", [1, 2])
def test_a_path_of_one_or_two_samples_is_kept_whole(count):
    rows = rows_within(np.arange(float(count)), np.zeros((count, 1)), np.ones(1), 10)
    assert rows.tolist() == list(range(count))
