"""Intervals, rows left out, weights, loss and evidence: closed forms, deletion one by one, chance."""

from __future__ import annotations

import re
from dataclasses import replace

import numpy as np
import pytest
from noisy_arm import arm, exact, noisy
from scipy.stats import t as student

from coupling.errors import IdentifyError
from coupling.identification.evidence import support
from coupling.identification.intervals import _jackknife, intervals, left_out
from coupling.identification.least_squares import LinearProblem
from coupling.identification.static.elastic import ElasticParameters
from coupling.identification.static.fit import IdentifyOptions, StaticFit, fit_static
from coupling.identification.static.identification import identify
from coupling.identification.static.measurements import Measurements, noise_of, whitening
from coupling.identification.static.model import StaticModel
from coupling.identification.static.prediction import rigid_prediction
from coupling.identification.static.suspicions import loss_suspicion
from coupling.results.parameter_result import EvidenceResult


def random_problem(seed: int, rows: int = 9, parameters: int = 4) -> LinearProblem:
    rng = np.random.default_rng(seed)
    size = 10.0 ** rng.uniform(2, 6, parameters)
    columns, p = (
        rng.normal(size=(rows, 3, parameters)) * size,
        rng.uniform(0.5, 2.0, parameters) / size,
    )
    target = columns @ p + 0.05 * rng.normal(size=(rows, 3))
    return LinearProblem.of(columns, target, p)


def test_bounded_least_squares_keeps_to_the_conditions_of_the_optimum():
    """Gradient zero where p > 0, not pulling down where p = 0 (Karush, Kuhn and Tucker)."""
    held = 0
    for seed in range(30):
        problem = random_problem(seed)
        problem = replace(problem, target=np.random.default_rng(seed).normal(size=(9, 3)))
        p = problem.solve()
        gradient = problem.scaled.T @ problem.residual(p).ravel()
        free = p > 0.0
        held += np.count_nonzero(~free)
        size = np.linalg.norm(problem.target)
        assert np.abs(gradient[free]).max(initial=0.0) < 1e-12 * size
        assert gradient[~free].max(initial=-size) < 0.0
    assert held > 20


def test_rows_left_out_and_the_jackknife_are_fits_of_the_others():
    problem = random_problem(1)
    errors, p = left_out(problem, np.ones(9)), problem.solve(-np.inf)
    count, numbers = len(p), problem.target.size
    moved, alone = _jackknife(problem, problem.residual(p))
    assert np.all(alone < 0)
    assert numbers == 27
    for i in range(len(problem.target)):
        columns = np.delete(problem.columns, i, axis=0).reshape(-1, count)
        other = np.linalg.lstsq(columns, np.delete(problem.target, i, axis=0).ravel())[0]
        np.testing.assert_allclose((p + problem.scale * moved[:, i]), other, rtol=1e-9)
        expected = problem.target[i] - problem.columns[i] @ other
        np.testing.assert_allclose(errors[i], expected, rtol=0, atol=1e-9)


def test_rows_left_out_meet_bounds_as_well():
    """Columns that are alike or zero, values at their bound: as one fit for each row."""
    rng = np.random.default_rng(0)
    for case in range(40):
        rows, count = int(rng.integers(8, 14)), int(rng.integers(1, 7))
        size = 10.0 ** rng.uniform(2, 6, count)
        columns, p = rng.normal(size=(rows, 3, count)) * size, rng.uniform(0, 1, count) / size
        columns[:, :, -1] *= 0.0 if case % 4 == 0 else 1.0
        if case % 3 == 0:
            columns[:, :, 0] = 2.0 * columns[:, :, -1]
        target = columns @ p + 0.3 * rng.normal(size=(rows, 3))
        problem = LinearProblem.of(columns, target, p)
        errors = left_out(problem, np.ones(rows))
        for i in range(rows):
            other = problem.without(i).solve()
            expected = problem.target[i] - problem.columns[i] @ other
            np.testing.assert_allclose(errors[i], expected, rtol=0, atol=1e-9)


def test_what_one_row_alone_tells_is_said_and_spoils_nothing_else():
    """A parameter that acts in row 4 alone: no leave-one-out error of it, and the row is named."""
    problem = random_problem(3)
    columns = problem.columns.copy()
    columns[np.arange(9) != 4, :, 2] = 0.0
    target = columns @ problem.start + 0.05 * np.random.default_rng(1).normal(size=(9, 3))
    alone = LinearProblem.of(columns, target, problem.start)
    found = intervals(alone, np.ones(9), alone.solve(), is_noise_known=False)
    assert found.rests_on.tolist() == [-1, -1, 4, -1]
    assert np.isfinite(found.high[2])
    others = alone.only(np.arange(4) != 2)
    errors = left_out(alone, np.ones(9))
    assert np.abs(errors).max() < 2.0 * np.abs(left_out(others.without(4), np.ones(8))).max()


def test_an_interval_is_students_or_wider():
    problem = random_problem(2)
    p = problem.solve(-np.inf)
    found = intervals(problem, np.ones(9), np.abs(p), is_noise_known=False)
    columns, rest = problem.columns.reshape(-1, 4), problem.residual(p)
    variance = np.sum(rest**2) / (27 - 4) * np.diag(np.linalg.inv(columns.T @ columns))
    half = student.ppf(0.975, 23) * np.sqrt(variance)
    assert found.freedom == 23
    assert np.all(found.high - p >= half * (1 - 1e-9))
    assert np.any(np.isclose(found.high - p, half, rtol=1e-9))


@pytest.mark.parametrize("known", [False, True])
def test_intervals_hold_the_truth_as_often_as_they_say(known):
    """0.02 mm and 5 N, 25 repetitions of 8 rows; docs/scripts/make_identify.py does more, by MuJoCo."""
    true = arm(tilt=True)
    rows, rng = exact(true, 8, seed=1), np.random.default_rng(2)
    elasticity = ElasticParameters.of(true, "backlash")
    start = ElasticParameters.of(elasticity.described(1.3 * elasticity.start), "backlash")
    inside = np.zeros(len(elasticity.names))
    for _ in range(25):
        own = noisy(rows, rng, 2e-5, 5.0)
        noise = noise_of(own, 2e-5, None, 5.0, None) if known else noise_of(own)
        fit = fit_static(start, own, IdentifyOptions(noise))
        assert fit.converged
        found = intervals(fit.experiment.linear, fit.experiment.weight, fit.x, known)
        inside += (found.low <= elasticity.start) & (elasticity.start <= found.high)
        assert 0.4 < found.scale / (1.0 if known else 2e-5) < 2.5
    assert np.all(inside >= 0.8 * 25)
    assert inside.sum() >= 0.93 * 25 * len(inside)


def test_weights_are_the_covariance_of_what_was_measured():
    """Deflections of samples with noise on reading and force have the covariance that is whitened."""
    true, rng = arm(), np.random.default_rng(0)
    rows = exact(true, 1, seed=5)
    elasticity = ElasticParameters.of(true, "backlash")
    noise = noise_of(rows, 1e-5, None, 40.0, None)
    white = whitening(noise, rigid_prediction(elasticity, rows, elasticity.start).by_wrench)[0]
    many = Measurements.of(
        np.repeat(rows.q, 2000, axis=0),
        np.repeat(rows.wrench, 2000, axis=0),
        np.zeros((2000, 3)),
    )
    errors = rigid_prediction(elasticity, noisy(many, rng, 0.0, 40.0), elasticity.start).deflection
    errors = errors - errors.mean(axis=0) + 1e-5 * rng.normal(size=errors.shape)
    np.testing.assert_allclose(np.cov(white @ errors.T), np.eye(3), atol=0.12)
    assert np.abs(white @ np.diag([1e-5] * 3) - np.eye(3)).max() > 0.3  # the force's part counts


def test_a_row_that_is_off_hardly_moves_the_robust_fit():
    true = arm()
    rows = noisy(exact(true, 20, seed=3), np.random.default_rng(4), 1e-5)
    elasticity = ElasticParameters.of(true, "backlash")
    spoiled = rows.deflection.copy()
    spoiled[7] += 5e-3
    rows = replace(rows, deflection=spoiled)
    error = {}
    for loss in ("squares", "huber"):
        fit = fit_static(elasticity, rows, IdentifyOptions(noise_of(rows), "backlash", loss))
        assert fit.converged
        error[loss] = np.abs(fit.x / elasticity.start - 1.0).max()
    assert 5.0 * error["huber"] < error["squares"]
    assert fit.experiment.weight[7] < 0.1
    assert fit.experiment.weight[7] == fit.experiment.weight.min()


@pytest.mark.parametrize(
    ("given", "words"),
    [
        ({"force": 5.0}, "beside those of the loads"),
        ({"position": 0.0}, "> 0"),
    ],
)
def test_deviations_that_do_not_suffice_are_refused(given, words):
    with pytest.raises(IdentifyError, match=words):
        noise_of(exact(arm(), 2, seed=0), **given)


def test_deviations_of_positions_alone_do_not_weigh_rotations():
    rows = exact(arm(), 2, seed=0)
    turned = replace(
        rows,
        deflection=np.zeros((2, 6)),
        deflection_deviation=np.full((2, 6), np.nan),
    )
    with pytest.raises(IdentifyError, match="--sd-rad"):
        noise_of(turned, position=1e-5)


def tilt_in(count: int) -> tuple[StaticFit, int, EvidenceResult]:
    """Return a fit to so many rows of an arm with a tilt, the tilt's number, and how it is supported."""
    robot = arm(tilt=True)
    rows = noisy(exact(robot, count, seed=1), np.random.default_rng(0), 2e-5)
    fit = fit_static(ElasticParameters.of(robot, "backlash"), rows, IdentifyOptions(noise_of(rows)))
    number = fit.elasticity.names.index("joint[3].tilt[1].stiffness")
    return (
        fit,
        number,
        support(fit.experiment.linear, np.arange(4) == number, fit.experiment.weight, tests=1),
    )


@pytest.mark.parametrize(("count", "is_trimmed"), [(11, False), (12, True)])
def test_evidence_is_told_without_the_worst_rows_where_three_are_a_quarter_at_most(
    count, is_trimmed
):
    _, _, found = tilt_in(count)
    assert found.supported
    assert (found.left_out_change_without_worst is not None) is is_trimmed


def test_f_is_t_squared_and_leave_one_out_is_that_of_both_models():
    fit, number, found = tilt_in(14)
    columns = fit.experiment.linear.columns.reshape(-1, 4)
    rest = fit.experiment.linear.residual(fit.experiment.linear.solve())
    variance = np.sum(rest**2) / (rest.size - 4) * np.linalg.inv(columns.T @ columns)
    t = fit.x[number] / np.sqrt(variance[number, number])
    np.testing.assert_allclose(found.F, t**2, rtol=1e-6)
    problems = fit.experiment.linear.only(np.arange(4) != number), fit.experiment.linear
    without, within = (
        np.sum(left_out(problem, fit.experiment.weight) ** 2) for problem in problems
    )
    assert found.left_out_change == pytest.approx(np.sqrt(within / without) - 1.0)
    assert found.supported


@pytest.mark.parametrize("seed", range(2))
def test_a_tilt_that_is_there_is_added_and_one_that_is_not_is_not(seed):
    rng, axial = np.random.default_rng(seed), arm()
    for true, added in ((arm(tilt=True), ("joint[3].tilt[1].stiffness",)), (axial, ())):
        rows = noisy(exact(true, 16, seed=seed + 10), rng, 1e-5)
        found = identify(axial, rows, IdentifyOptions(noise_of(rows), add=("supported",)))
        assert tuple(p.name for p in found.result.parameters if p.added) == added
        if added:
            (own,) = [p for p in found.result.parameters if p.name in added]
            assert own.identified
            assert own.low < 8e5 < own.high


def test_a_tilt_of_the_start_file_without_support_keeps_its_value():
    rows = noisy(exact(arm(), 16, seed=4), np.random.default_rng(3), 1e-5)
    start = arm(tilt=True)
    found = identify(start, rows, IdentifyOptions(noise_of(rows)))
    (own,) = [p for p in found.result.parameters if "tilt" in p.name]
    assert not own.identified
    assert found.robot.joints[2].tilt[0].stiffness == pytest.approx(
        start.joints[2].tilt[0].stiffness, rel=1e-12
    )


def test_backlash_that_loads_reverse_is_found_by_name():
    """Joint 1 of an upright arm hangs amid its backlash, and every load takes it to a flank."""
    loose = replace(arm().joints[0], backlash=2e-4)
    true = replace(arm(), joints=(loose, *arm().joints[1:]))
    rows = noisy(exact(true, 16, seed=5), np.random.default_rng(1), 1e-5)
    found = identify(arm(), rows, IdentifyOptions(noise_of(rows), add=("joint[1].backlash",)))
    (own,) = [p for p in found.result.parameters if p.kind == "backlash"]
    assert own.identified
    assert own.low < 2e-4 < own.high < 3e-4
    with pytest.raises(IdentifyError, match=r"did you mean 'joint\[1\]\.backlash'"):
        identify(arm(), rows, IdentifyOptions(noise_of(rows), add=("joint[1].backlsh",)))


@pytest.mark.parametrize(("part", "words"), [(-5e-5, "friction"), (0.0, ""), (5e-5, "backlash")])
def test_a_constant_part_of_every_deflection_is_suspected(part, words):
    rows, rng = exact(arm(), 24, seed=6), np.random.default_rng(2)
    rows = replace(rows, wrench=rows.wrench * rng.uniform(0.1, 1.0, (24, 1)))
    elasticity = ElasticParameters.of(arm(), "linear")
    right = StaticModel(elasticity, rows, "linear").predict(elasticity.start).deflection
    way = right / np.linalg.norm(right, axis=1, keepdims=True)
    rows = noisy(replace(rows, deflection=right + part * way), rng, 5e-6)
    found = identify(arm(), rows, IdentifyOptions(noise_of(rows), "linear"))
    assert found.result.common_loss is not None
    assert abs(-found.result.common_loss.value_m - part) < found.result.common_loss.half_m
    said = loss_suspicion(found.result.common_loss)
    assert (words in said) if words else said == ""


@pytest.mark.parametrize("which", ["measured point", "load point"])
def test_a_point_that_was_elsewhere_is_suspected_where_it_was(which):
    """Made with one point 5 mm off, read as at the TCP; a right table raises no suspicion."""
    rng, shift = np.random.default_rng(4), np.array([0.003, -0.004, 0.001])
    rows = exact(arm(), 20, seed=8)
    place = {which.replace(" ", "_"): np.tile(shift, (20, 1))}
    elasticity = ElasticParameters.of(arm(), "linear")
    off = StaticModel(elasticity, replace(rows, **place), "linear").predict(elasticity.start)
    spoiled = noisy(replace(rows, deflection=off.deflection), rng, 1e-7)
    found = identify(arm(), spoiled, IdentifyOptions(noise_of(spoiled), "linear"))
    (words,) = [words for words in found.result.warnings if f"the {which} seems to be" in words]
    place = [float(number) for number in words.partition("[")[2].partition("]")[0].split(",")]
    np.testing.assert_allclose(place, shift, atol=5e-4)
    # On a first screen, for somebody who measures: a figure of the prediction, not of a test.
    assert re.search(r"predicted [0-9]+ % better$", words)
    right = noisy(rows, rng, 5e-6)
    found = identify(arm(), right, IdentifyOptions(noise_of(right), "linear"))
    assert not any("seems to be" in words for words in found.result.warnings)
