"""Fits of parameters of robots that are known."""

from dataclasses import replace

import numpy as np
import pytest
from circling_robots import NOISE, Robots, stored_fit
from scipy.signal import lfilter

from coupling.errors import SimulationError
from coupling.identification.estimate import estimate
from coupling.identification.runs.experiment import RunExperiment, size_of
from coupling.identification.runs.fit import _free, _restarted, fit_runs
from coupling.identification.runs.judge import judge_parameters
from coupling.identification.runs.measurement import MeasuredPath, SimulatedPath
from coupling.identification.runs.parameters import prior_of
from coupling.identification.runs.whitening import UnmodelledSpectrum
from coupling.inverse.diagnosis import diagnose
from coupling.inverse.inversion import MovingRobot
from coupling.robot.robot_fmu import RobotFmu
from elastic_robot.description import Robot


@pytest.fixture(scope="module")
def robots(example, models):
    return Robots(example, models, seconds=5.0, rate=0.4)


def test_a_fit_that_ends_in_a_hollow_is_led_out_of_it(robots, example):
    """Five seconds of a robot up to 45 % other: noise is left, and what is told lies in its interval."""
    short = Robots(example, robots.models, seconds=5.0)
    prior = prior_of(short.parameters)
    truth = short.drawn(108, 1.5)
    problem = short.problem(short.measured(short.moved(truth)))
    found = stored_fit(problem, 0.0 * truth)
    assert size_of(found.experiment.slow) < 1.12 * problem.noise(found.experiment.residuals)
    told = np.flatnonzero(found.deviation < 0.5 * prior)
    assert len(told) >= 3
    assert np.all(np.abs(found.x[told] - truth[told]) < found.half[told])
    for name in ("joint[1].backlash", "joint[4].backlash", "joint[5].backlash"):
        own = [p.name for p in short.parameters].index(name)
        assert found.x[own] == pytest.approx(truth[own], abs=0.05)


def test_a_fit_looks_along_the_run(robots, example):
    """Six seconds of four circles: what a crossing does wrong is past before the next one."""
    fast = Robots(example, robots.models, seconds=6.0, rate=2.0 / 3.0)
    truth = fast.drawn(405, 1.5)
    problem = fast.problem(fast.measured(fast.moved(truth)))
    found = stored_fit(problem, 0.0 * truth)
    assert size_of(found.experiment.slow) < 1.1 * problem.noise(found.experiment.residuals)


def test_processes_beside_each_other_change_no_digit(robots, example):
    """What is found by one process and by two, with restarts."""
    short = Robots(example, robots.models, seconds=2.0)
    truth = short.drawn(31, 1.0)
    problem = short.problem(short.measured(short.moved(truth), every=5))
    with RobotFmu(short.fmu.file) as other:
        points = []
        for fmus in (problem.fmus, (*problem.fmus, other)):
            start = RunExperiment.behind_frame(replace(problem, fmus=fmus), 0.0 * truth)
            points.append(_restarted(start))
    single, both = points
    assert single.cost(single) < start.cost(start)
    np.testing.assert_array_equal(single.x, both.x)


def test_the_robot_found_is_at_least_as_likely_as_the_one_that_was_measured(robots, example):
    """Where stiffnesses make up for each other the valley is bent; a fit follows it to its ground."""
    short = Robots(example, robots.models, seconds=5.0)
    truth = short.drawn(705, 1.0)
    problem = short.problem(short.measured(short.moved(truth)))
    fit = stored_fit(problem, 0.0 * truth)
    variance = problem.noise(fit.experiment.residuals) ** 2 / 3.0
    likely = replace(problem, spectrum=fit.experiment.problem.spectrum, variance=variance)
    here = RunExperiment.of(likely, fit.x)
    assert here.cost(here) < RunExperiment.behind_frame(likely, truth).cost(here)


@pytest.mark.parametrize("deviation", [0.0, 3e-5])
def test_the_spectrum_of_what_the_model_does_not_know_is_that_of_the_measurement(robots, deviation):
    """Nothing where there is nothing; and the standard deviation of a Markov process that was added."""
    measured = robots.measured(robots.moved(robots.factors()))
    count, step = len(measured.measured.time), float(np.median(np.diff(measured.measured.time)))
    decay, rng = float(np.exp(-2.0 * np.pi * 0.5 * step)), np.random.default_rng(7)
    shocks = deviation * np.sqrt(1.0 - decay**2) * rng.standard_normal((count, 3))
    position = measured.measured.position + lfilter([1.0], [1.0, -decay], shocks, axis=0)
    seen = replace(measured, measured=replace(measured.measured, position=position))
    fit = fit_runs(robots.problem(seen), np.zeros(len(robots.parameters)))
    density, expected = (
        spectrum.density(np.array([1.0]))[0]
        for spectrum in (fit.experiment.problem.spectrum, UnmodelledSpectrum(deviation, 0.5))
    )
    noise = 2.0 * NOISE**2 * step
    assert expected / 3.0 - noise < density < 3.0 * expected + noise


def test_a_step_to_a_robot_that_gives_way_is_not_taken_and_no_parameter_is_too_sure(
    robots, monkeypatch
):
    """The fit goes on with a shorter one.

    Differences of simulations take when an unloaded gear leaves its flank for knowledge of it: a
    parameter is as sure as the derivatives that tell less make it.
    """
    truth = robots.factors(backlash=1.2, damping=0.9)
    one, simulated = robots.measured(robots.moved(truth), every=3), MeasuredPath.simulated
    at, tried = RunExperiment.at, [0]

    def too_soft(self: MeasuredPath, fmu: RobotFmu, robot: Robot) -> SimulatedPath:
        raise SimulationError("the joints are too soft for this load")

    def at_first(self: RunExperiment, x: np.ndarray) -> RunExperiment | None:
        tried[0] += 1
        monkeypatch.setattr(MeasuredPath, "simulated", too_soft if tried[0] <= 2 else simulated)
        point = at(self, x)
        monkeypatch.setattr(MeasuredPath, "simulated", simulated)
        assert (point is None) == (tried[0] <= 2)
        return point

    monkeypatch.setattr(RunExperiment, "at", at_first)
    problem = robots.problem(one)
    found = fit_runs(problem, 0.0 * truth)
    assert tried[0] > 10
    assert size_of(found.experiment.slow) < 1.12 * problem.noise(found.experiment.residuals)
    variance = found.left_over.over * problem.noise(found.experiment.residuals) ** 2 / 3.0
    point = found.experiment.weighted(found.experiment.problem.spectrum, variance)
    by_equation, by_simulation = (
        np.sqrt(np.diag(np.linalg.inv(replace(point, slopes=point.slopes_by(own)).equations[0])))
        for own in (problem.effects, problem.secants(0.05))
    )
    own = np.sqrt(np.diag(found.covariance))
    stiff = [k for k, p in enumerate(robots.parameters) if p.kind == "stiffness"]
    assert np.min(by_simulation[stiff] / by_equation[stiff]) < 0.8
    every = slice(len(robots.parameters))
    assert np.all(own[every] > 0.999 * np.maximum(by_equation, by_simulation)[every])


def test_what_hardly_matters_is_written_as_it_fits_beside_the_others(robots):
    """As these make up for it; what the path does not depend on stays as it is in the file."""
    prior = prior_of(robots.parameters)
    x, effect = 0.3 * prior, np.full(len(prior), 1e-6)
    effect[:5] = 0.0
    gears = diagnose(MovingRobot(robots.robot, "backlash"), robots.wanted)
    verdicts = judge_parameters(robots.parameters, x, prior, 2.0 * prior, prior, effect, gears)
    assert not any(own.identified or own.significant for own in verdicts)
    assert all(own.written == own.start for own in verdicts[:5])
    factors = [own.written / own.start for own in verdicts[5:]]
    np.testing.assert_allclose(np.log(factors), x[5:])
    assert verdicts[0].remark.startswith("NOT IDENTIFIED, start value kept: ")
    assert verdicts[-1].remark.startswith(
        "best fit with the others, but not significant on this path"
    )


def test_the_dampers_of_tilts_are_fitted_where_the_robot_vibrates(robots, example):
    """Six seconds of four circles under steps of force; tilts are damped by half more than in the file.

    All else is known.  Noise is left; where these dampers are those of the file, the best robot beside
    the one found leaves a fifth more than noise.
    """
    fast = Robots(example, robots.models, seconds=6.0, rate=2.0 / 3.0)
    dampers = np.array([own.vibrates for own in fast.parameters])
    assert dampers.sum() == 6
    known = fast.drawn(110, 1.0)
    measured = fast.measured(fast.moved(known + np.log(1.5) * dampers))
    found = stored_fit(fast.problem(measured), known)
    assert found.left_over.over < 1.3
    fast.parameters = tuple(own for own in fast.parameters if not own.vibrates)
    problem = fast.problem(measured)
    start = RunExperiment.of(problem, np.delete(found.x, np.flatnonzero(dampers)))
    change = np.full(len(fast.parameters), 0.01)
    start = replace(start, derivatives=problem.secants(0.01), reach=change).recompute()
    best = estimate(start, _free(problem), 12, 0.15)
    assert found.experiment.over_noise**2 < 1.05
    assert best.experiment.over_noise**2 > 1.2
