"""Statistics of a study against closed forms: quantiles, bands, shares of the variance."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.stats import qmc

from coupling.path.deviation import measure
from coupling.path.histories import ToolPath
from coupling.run.uncertain_parameters import DESIGNS
from coupling.study.statistics import (
    DeviationBand,
    influences,
    parts_of_path,
    quantile,
    samples_for,
)

PLACES = np.linspace(0.0, 1.0, 60)
MANY = 40_000


def deviations(points: np.ndarray) -> np.ndarray:
    """A robot's deviation along its path, of three uniform parameters: kinked, skewed, with a peak."""
    a, b, c = points.T[:, :, None]
    swing = np.abs(2.0 * a - 1.0) * (1.0 + np.sin(9.0 * PLACES)) + b**2 * PLACES
    return swing + np.exp(-(((PLACES - 0.6 - 0.1 * c) / 0.05) ** 2))


@pytest.fixture(scope="module")
def fresh() -> np.ndarray:
    return deviations(np.random.default_rng(99).random((MANY, 3)))


@pytest.mark.parametrize("design", DESIGNS)
@pytest.mark.parametrize("seed", [1, 2, 3])
def test_the_band_of_200_robots_holds_90_percent_of_fresh_ones(fresh, design, seed):
    """In the mean over the path 88 to 92 %; below the line, one number of each robot, 86 to 94 %."""
    band = DeviationBand.of(deviations(DESIGNS[design](200, 3, seed)), 0.9)
    held = (fresh >= band.low) & (fresh <= band.high)
    assert 0.88 <= held.mean() <= 0.92
    assert 0.86 <= np.all(fresh <= band.everywhere, axis=1).mean() <= 0.94


@pytest.mark.parametrize("count", [19, 40, 200])
def test_in_the_mean_over_studies_the_coverage_is_exact(fresh, count):
    """Of n independent robots, however few: to 4 standard errors of the mean over 400 studies."""
    rng = np.random.default_rng(count)
    held, below = [], []
    for _ in range(400):
        band = DeviationBand.of(deviations(rng.random((count, 3))), 0.9)
        some = fresh[rng.integers(MANY, size=400)]
        held.append(((some >= band.low) & (some <= band.high)).mean())
        below.append(np.all(some <= band.everywhere, axis=1).mean())
    assert np.mean(held) == pytest.approx(0.9, abs=4.0 * np.std(held) / 20.0)
    # Below the line there are more than claimed rather than fewer.
    error = 4.0 * np.std(below) / 20.0
    assert 0.9 - error < np.mean(below) < 0.9 + 1.0 / count + error


def test_the_first_band_that_can_hold_its_share_is_from_the_least_to_the_largest():
    for coverage in (0.5, 0.8, 0.9, 0.99):
        count = samples_for(coverage)
        values = np.random.default_rng(1).random(count)
        tail = 0.5 * (1.0 - coverage)
        assert quantile(values, tail) == pytest.approx(values.min(), abs=1e-12)
        assert quantile(values, 1.0 - tail) == pytest.approx(values.max(), abs=1e-12)
        fewer = values[:-1]
        assert quantile(fewer, 1.0 - tail) == fewer.max()


def test_shares_are_first_order_sobol_indices():
    """y = |x1| + 0.5 x2 + x3 x4 on [-1, 1]: variances 1/12, 1/12 and 1/9, the last of both together."""
    shares = []
    for seed in range(20):
        u = qmc.Sobol(4, rng=seed).random_base2(8)
        x = 2.0 * u - 1.0
        found = influences(u, np.abs(x[:, 0]) + 0.5 * x[:, 1] + x[:, 2] * x[:, 3])
        assert found is not None
        shares.append([own.share for own in found])
        assert abs(found[0].rank_correlation) < 0.25 < found[1].rank_correlation
    whole = 1 / 12 + 1 / 12 + 1 / 9
    np.testing.assert_allclose(
        np.mean(shares, axis=0), np.array([1 / 12, 1 / 12, 0.0, 0.0]) / whole, atol=0.02
    )
    assert np.max(shares, axis=0)[2:].max() < 4 / 256


def test_influences_of_too_few_samples_or_no_variance():
    x = np.random.default_rng(0).random((200, 10))
    assert influences(x[:30], x[:30, 0]) is None
    assert influences(x[:100], x[:100, 0]) is not None  # of the second degree
    assert {own.share for own in influences(x, np.ones(200))} == {0.0}


def test_equal_figures_have_no_influences_though_their_mean_is_rounded():
    """0.1 and its mean over 3000 differ in the last digit."""
    figure = np.full(3000, 0.1)
    assert np.var(figure) > 0.0
    shares = influences(np.random.default_rng(1).random((3000, 1)), figure)
    assert shares is not None
    assert (shares[0].share, shares[0].rank_correlation) == (0.0, 0.0)


def test_the_largest_in_a_part_keeps_every_peak():
    rng = np.random.default_rng(3)
    time = np.cumsum(rng.uniform(0.001, 0.01, 5000))
    distance = rng.random(5000)
    first = parts_of_path(time, 400)
    kept = np.maximum.reduceat(distance, first)
    assert len(kept) == 400
    path = np.zeros((5000, 7))
    path[:, 6] = 1.0
    desired, moved = ToolPath(time, path), path.copy()
    moved[:, 0] = distance
    assert kept.max() == measure(ToolPath(time, moved), desired).maximum
    edges = [*first, len(time)]
    assert all(kept[k] == distance[edges[k] : edges[k + 1]].max() for k in range(400))
    assert len(parts_of_path(time[:7], 400)) == 7


def test_a_longer_sobol_study_begins_with_the_shorter_one():
    short, long = (DESIGNS["sobol"](count, 5, 11) for count in (100, 300))
    assert np.array_equal(long[:100], short)
    assert not np.array_equal(DESIGNS["sobol"](100, 5, 12), short)
