"""Rows at which a command is replayed on robots that differ from the model."""

from __future__ import annotations

import numpy as np
import pytest

from coupling.path.histories import WrenchHistory
from coupling.run.replayed_command import replay_rows

CYCLE = 4e-3


def loads_of(force: np.ndarray, time: np.ndarray) -> WrenchHistory:
    wrench = np.zeros((len(time), 6))
    wrench[:, 2] = force
    return WrenchHistory(time, wrench)


@pytest.mark.parametrize("seed", range(5))
def test_a_straight_wrench_is_the_same_on_the_rows_of_its_bends(seed):
    """Samples at any distances, seen every 4 ms as well: what the robot feels does not change."""
    random = np.random.default_rng(seed)
    samples = np.append(0.0, np.cumsum(CYCLE * random.integers(1, 12, 60)))
    force = 300.0 * random.standard_normal(len(samples))
    time = np.arange(round(samples[-1] / CYCLE) + 1) * CYCLE
    loads = loads_of(np.interp(time, samples, force), time)
    rows = replay_rows(loads)
    again = loads.refined(time[rows]).at(time)
    np.testing.assert_allclose(again, loads.wrench, atol=1e-9)
    assert np.diff(time[rows]).max() < 2.0 * CYCLE + 1e-12
    assert len(rows) < 0.8 * len(time)


def test_under_a_wrench_that_bends_from_row_to_row_every_row_is_replayed():
    """As with the teeth of a mill."""
    time = np.arange(400) * 1e-4
    loads = loads_of(np.abs(np.sin(2000.0 * time)), time)
    assert replay_rows(loads).tolist() == list(range(400))


def test_jumps_are_rows_even_where_nothing_jumps():
    time = np.arange(11) * 1e-3
    means = np.eye(6)[np.arange(11) // 4]
    means[8:] = 0.0
    loads = WrenchHistory.of_means(time, means)
    rows = replay_rows(loads)
    assert set(np.searchsorted(loads.instants, loads.jumps)) <= {*rows.tolist()}
    refined = loads.refined(loads.instants[rows])
    np.testing.assert_array_equal(refined.at(loads.instants), loads.at(loads.instants))


def test_two_rows_are_the_fewest():
    assert replay_rows(loads_of(np.zeros(2), np.array([0.0, 10.0]))).tolist() == [0, 1]
