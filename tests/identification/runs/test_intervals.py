"""Intervals of what was learned: that they hold, and what is left over noise does to them."""

from dataclasses import replace

import numpy as np
import pytest
from circling_robots import NOISE, Robots, stored_fit

from coupling.identification.runs.judge import discrepancy, measurement_lacks
from coupling.identification.runs.residual import UnexplainedPart
from coupling.inverse.diagnosis import diagnose
from coupling.inverse.inversion import MovingRobot
from docs.scripts.learning_beyond import Beyond

PRIOR = np.full(8, 0.3)


@pytest.fixture(scope="module")
def robots(example, models):
    return Robots(example, models, seconds=4.0)


def fitted(
    rng: np.random.Generator, discrepancy: float
) -> tuple[np.ndarray, np.ndarray, UnexplainedPart]:
    """Errors of a linear fit by the deviations of its noise alone, these, and what is left over noise.

    Of 200 rows of noise 1 and eight parameters; a discrepancy of so many times the noise with 30
    independent values along the rows, the others between them straight.
    """
    at = np.linspace(0.0, 1.0, 200)
    columns = 30.0 * np.sin(np.outer(at, 1.0 + np.arange(8.0)) * np.pi)
    truth = PRIOR * rng.standard_normal(8)
    beyond = np.interp(at, np.linspace(0.0, 1.0, 30), discrepancy * rng.standard_normal(30))
    seen = columns @ truth + beyond + rng.standard_normal(200)
    data, over = columns.T @ columns, 1.0
    for _ in range(3):
        inverse = np.linalg.inv(np.diag(PRIOR**-2.0) + data / over)
        found = inverse @ (columns.T @ seen) / over
        left = UnexplainedPart.of(float(np.sum((seen - columns @ found) ** 2)), 200.0, data, PRIOR)
        over = left.over
    deviation = np.sqrt(np.diag(np.linalg.inv(np.diag(PRIOR**-2.0) + data)))
    return found - truth, deviation, left


@pytest.mark.parametrize("discrepancy", [0.0, 2.0, 10.0])
def test_intervals_of_linear_fits_hold_with_a_discrepancy_too(discrepancy):
    """Of noise alone 95 %; of a discrepancy at least as many, where those by noise would hold few."""
    rng = np.random.default_rng(3)
    trials = [fitted(rng, discrepancy) for _ in range(200)]
    held, by_noise = (
        np.mean([np.abs(e) < 1.96 * wide * own for e, own, _, wide in rows])
        for rows in (
            [(*one, one[2].widened) for one in trials],
            [(*one, 1.0) for one in trials],
        )
    )
    assert held > 0.93
    if discrepancy == 0.0:
        assert held < 0.98
        assert np.median([left.over for _, _, left in trials]) == 1.0
    else:
        assert by_noise < 0.8


def test_parameters_that_are_off_leave_what_widens_their_intervals_to_them():
    """Eight that are told, each five deviations off: a fit says of itself to be five off, nearly."""
    data = 1e6 * np.eye(8)
    rows = 400.0
    squares = rows - 8.0 + np.sqrt(2.0 * rows) + 8.0 * 5.0**2
    assert UnexplainedPart.of(squares, rows, data, PRIOR).widened == pytest.approx(
        np.sqrt(26.0), rel=1e-3
    )
    assert UnexplainedPart.of(rows, rows, data, PRIOR).widened == 1.0


def test_what_the_model_does_not_know_widens_intervals_and_is_not_learned(robots):
    """Gear errors, hysteresis and drift, more than the backlash does: they are taken for a spectrum of
    their size, and the robot is not missed by more than its file misses it."""
    truth = robots.factors(backlash=1.2, damping=0.8)
    one = robots.measured(robots.moved(truth))
    own = Beyond(gear_errors=7e-5, hysteresis=3e-5, drift=5e-5)
    home = one.command.q[0][0]
    extra = own.at(robots.robot, home, one.command, one.measured.time)
    seen = replace(one.measured, position=one.measured.position + extra)
    problem = robots.problem(replace(one, measured=seen))
    fit = stored_fit(problem, np.zeros(len(robots.parameters)))
    x = fit.x[: len(truth)]
    assert fit.noise == pytest.approx(NOISE, rel=0.1)
    size = np.sqrt(np.mean(np.var(extra, axis=0)))
    assert 0.5 * size < fit.experiment.problem.spectrum.deviation < 3.0 * size
    assert np.all(np.abs(x - truth) < fit.half)

    def less_mean(x: np.ndarray) -> float:
        missed = robots.moved(x) - robots.moved(truth)
        return float(np.sqrt(np.mean(np.sum((missed - missed.mean(axis=0)) ** 2, axis=1))))

    assert less_mean(x) < less_mean(0.0 * x)


def test_noise_is_not_blamed_for_what_the_model_does_not_know(robots):
    """Where gears reverse and nothing is identifiable: 7 of 45 um are noise, or 7 of 8."""
    gears = diagnose(MovingRobot(robots.robot, "backlash"), robots.wanted)
    assert any(gear.reversals for gear in gears)
    for left, words in (
        (45e-6, "45.0 um remain, noise alone would be 7.00 um"),
        (8e-6, "the noise conceals"),
    ):
        told = measurement_lacks(gears, gears, 4.0, discrepancy(49e-6, left, 7e-6))
        assert words in told
        assert ("noise conceals" in told) == (left < 1e-5)
