"""[study]: which parameters are uncertain, what is refused, and statistics of the samples."""

from dataclasses import replace

import numpy as np
import pytest
from line_case import moving_line
from places import LINE_CASE
from scipy.stats import qmc
from studies import moving

from coupling.case.file import load_case
from coupling.case.plant import Distribution, StudyTable
from coupling.errors import CaseError
from coupling.files.robot_file import find_robot, load_robot
from coupling.path.deviation import measure
from coupling.path.histories import ToolPath
from coupling.run.uncertain_parameters import DESIGNS, UncertainParameter, UncertainParameters
from coupling.study.conduct import changed_table
from coupling.study.statistics import (
    DeviationBand,
    influences,
    parts_of_path,
    quantile,
    samples_for,
)

# What is wrong with [study], and what the one message must contain.
BAD_STUDIES = {
    "unknown key": ("stiffnes_factor = [0.9, 1.1]", "did you mean 'stiffness_factor'"),
    "negative": ("damping_factor = [-0.1, 1.1]", "damping_factor: expected values >= 0, got -0.1"),
    "no stiffness": ("stiffness_factor = [0.0, 1.1]", "stiffness_factor: expected values > 0"),
    "upside down": (
        "force_factor = [1.1, 0.9]",
        "expected [low, high], low < high, got [1.1, 0.9]",
    ),
    "wide": ("backlash_factor = { mean = 1.0, deviation = 0.5 }", "expected values >= 0, got -0.5"),
    "half": ("backlash_factor = { mean = 1.0 }", "or { mean = .., deviation = .. }, got neither"),
    "both": ("force_factor = { low = 0.9, high = 1.1, mean = 1.0 }", "got neither"),
    "words": ('force_factor = "much"', "force_factor: expected [low, high] or"),
    "not finite": ("force_factor = [0.9, inf]", "force_factor: high: expected a finite number"),
    "no samples": ("samples = 0", "samples: expected a number greater than or equal to 1, got 0"),
    "few samples": ("samples = 5", "expected at least 19 for a band that holds 90 %"),
    "design": ('design = "grid"', "design: expected 'sobol' or 'latin-hypercube', got 'grid'"),
}
PLACES = np.linspace(0.0, 1.0, 60)
MANY = 40_000


@pytest.mark.parametrize("name", BAD_STUDIES)
def test_a_bad_study_is_one_message(tmp_path, name):
    table, words = BAD_STUDIES[name]
    with pytest.raises(CaseError) as refused:
        changed_table(load_case(moving(tmp_path, f"[study]\n{table}\n")).study)
    assert words in str(refused.value)
    assert "study: " in str(refused.value)


def test_what_means_nothing_is_left_out():
    """A linear robot has no backlash to be uncertain of, a free one no force."""
    factors = {f"{name}_factor": [0.9, 1.1] for name in ("stiffness", "backlash", "force")}
    case = replace(load_case(LINE_CASE), study=StudyTable.model_validate(factors))
    assert UncertainParameters.chosen(case, loaded=False).names == ("stiffness_factor",)
    assert UncertainParameters.chosen(case, loaded=False).silent == (
        "backlash_factor",
        "force_factor",
    )
    assert UncertainParameters.chosen(case, loaded=True).names[-1] == "force_factor"


def test_slip_torques_are_uncertain_where_gears_have_elements(tmp_path):
    """All alike or each by itself; without elements it is left out."""
    gear = "gear.hysteresis = [{ slip_torque = 40.0, slip_angle = 2e-5 }]\n"
    text = find_robot("icme2008").read_text().replace("backlash  =", f"{gear}backlash  =", 2)
    (tmp_path / "robot.toml").write_text(text)
    slipping = ('"icme2008"', '"robot.toml"')

    def parameters(more: str, *changes: tuple[str, str]) -> UncertainParameters:
        (tmp_path / "case.toml").write_text(f"{moving_line(*changes)}\n[study]\n{more}\n")
        return UncertainParameters.chosen(load_case(tmp_path / "case.toml"), loaded=False)

    alike = parameters("hysteresis_factor = [0.5, 1.5]", slipping)
    assert alike.names == ("hysteresis_factor",)
    assert alike.entries[-1].range == pytest.approx((0.5, 1.5))
    (changed,) = alike.sampled([0.9]).differences
    robot = load_robot(tmp_path / "robot.toml")
    assert changed.values(robot, "backlash") == {
        f"joint[{i}].hysteresis": pytest.approx(36.0, rel=1e-15) for i in (1, 2)
    }
    each = parameters("hysteresis_factor = [0.5, 1.5]\njoints = 'each'", slipping)
    assert each.names == ("hysteresis_factor[1]", "hysteresis_factor[2]")
    (changed,) = each.sampled([1.0, 0.5]).differences
    assert changed.values(robot, "linear") == {"joint[2].hysteresis": 20.0}
    assert parameters("hysteresis_factor = [0.5, 1.5]").silent == ("hysteresis_factor",)


def test_normal_parameters_have_their_moments():
    """Mean and deviation of a normal distribution that is cut off at three of it: 0.9733 of it."""
    parameter = UncertainParameter("force_factor", Distribution(mean=1.0, deviation=0.1))
    values = parameter.at((np.arange(20_000) + 0.5) / 20_000)
    assert values.mean() == pytest.approx(1.0, abs=1e-6)
    assert values.std() == pytest.approx(0.1 * np.sqrt(0.97334), rel=1e-4)
    assert parameter.range == pytest.approx((0.7, 1.3))


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
