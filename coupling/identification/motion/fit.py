"""The fit to recordings: restarts, backlashes that they support, identifiable parameters."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
from scipy.linalg import solve_triangular

from coupling.identification.estimate import CONVERGED, estimate
from coupling.identification.motion.experiment import NO_SLOPES, GearSlopes, MotionExperiment
from coupling.identification.motion.problem import MotionProblem

# Steps of a fit at most, and of one that only shows where it leads.
_STEPS, _FIRST_STEPS = 60, 6
# Predicted gain of log likelihood by the next step below which a fit ends.
_SETTLED = 1e-4
# Compliance that another fit starts from, in parts of what the first one gave.
_STIFF = 0.1
# A backlash is supported by recordings that are likelier by e to this with it: an interval of 95 %.
SUPPORTED = 2.0
# Size of slow errors, over the usual one, at least and at most: data sheets do not allow more.  Steps to
# the likeliest.
_LEAST_SLOW, _MOST_SLOW, _SIZINGS = 0.01, 1.0, 60
# An encoder's error is identifiable with an interval below this part of itself, or of its usual size,
# which shows that there is none.
_OF_ITSELF, _NARROW = 1.0, 0.3
# A fit from an end of an interval comes back as near as this part of its half.
_BACK = 0.3


def fit_motion(
    problem: MotionProblem,
    x: np.ndarray | None = None,
    near: GearSlopes = NO_SLOPES,
    steps: int = _STEPS,
    settled: float = _SETTLED,
) -> MotionExperiment:
    """Return the fit of a problem's parameters.

    Weights of channels, the state of friction and loops are those of the last step.  Derivatives of the
    gears' motion are kept up by steps that gain as predicted, and simulated where they do not or end.

    Args:
        x: Values to begin with [1], (P,); None: those of the start.
        near: Derivatives of the gears' motion near them; all others are simulated.
        steps: Steps at most.
        settled: Predicted gain of log likelihood below which it ends.
    """
    x = np.clip(_solve_sensors(problem) if x is None else x, *problem.bounds)
    start = MotionExperiment.of(problem, x).recompute(near)
    if not len(x):
        return replace(start, converged=True)
    estimated = estimate(start, problem.bounds, steps, settled)
    return replace(estimated.experiment, converged=estimated.converged)


def _solve_sensors(problem: MotionProblem) -> np.ndarray:
    """Return the start with the sensors' numbers solved for, (P,): linear, and a lag nearly."""
    of_sensor = np.array([bool(p.sensor) for p in problem.parameters], dtype=bool)
    x = problem.start.copy()
    if of_sensor.any():
        point = MotionExperiment.of(problem.only(of_sensor), x[of_sensor]).recompute()
        x[of_sensor] -= solve_triangular(*point.rows)
    return np.clip(x, *problem.bounds)


def fit_roughly(
    problem: MotionProblem, x: np.ndarray | None = None, near: GearSlopes = NO_SLOPES
) -> MotionExperiment:
    """Return the first steps of a fit, from x [1], (P,), with the arguments of `fit_motion`."""
    return fit_motion(problem, x, near, _FIRST_STEPS, CONVERGED)


def fit_with_restarts(problem: MotionProblem, first: MotionExperiment) -> MotionExperiment:
    """Return the likeliest of the fits from where a first one led, and from each gear stiffer in turn.

    An arm of another stiffness swings out of phase with what was measured, so that the squares have
    several minima, and least squares find the nearest.  Behind a stiff gear it hardly swings: from there
    they go down to the first.
    """
    best = fit_roughly(problem, first.x, first.slopes)
    for k in np.flatnonzero([p.inverse for p in problem.parameters]):
        stiff = best.x.copy()
        stiff[k] *= _STIFF
        restarted = fit_roughly(problem, stiff, best.slopes)
        if restarted.minus_log_likelihood < best.minus_log_likelihood:
            best = restarted
    return fit_motion(problem, best.x, best.slopes)


def select_backlashes(problem: MotionProblem, fit: MotionExperiment) -> MotionExperiment:
    """Return a fit with those backlashes of a problem that the recordings support, the others none.

    An unloaded link moves in its backlash in a way that no recording determines: the squares are then
    rugged along all parameters, and the end of a fit depends on the last digits of the measurement.

    Args:
        problem: The problem with all parameters.
        fit: The fit without any backlash.
    """
    none = np.array([p.vanishes for p in problem.parameters], dtype=bool)
    for k in np.flatnonzero(none):
        fewer = none & (np.arange(len(none)) != k)
        wider = problem.without(fewer)
        values = dict(zip((p.name for p in fit.problem.parameters), fit.x.tolist(), strict=True))
        without = np.array([values.get(p.name, 0.0) for p in wider.parameters])
        is_new = np.array([p.name not in values for p in wider.parameters])
        tried = fit_roughly(wider, np.where(is_new, wider.start, without), fit.slopes)
        least = MotionExperiment.of(wider, without).minus_log_likelihood
        if least - tried.minus_log_likelihood > SUPPORTED:
            none, fit = fewer, fit_motion(wider, tried.x, tried.slopes)
    return fit


def estimate_slow_errors(fit: MotionExperiment) -> MotionProblem:
    """Return a fit's problem with the size of slow errors that its recordings make likeliest.

    Expectation maximisation of the marginal likelihood (evidence, [MacKay1992]),
    joint by joint, all parameters to first order.
    """
    problem, blocks = fit.problem, fit.blocks
    prior = np.array([p.prior for p in problem.parameters])
    slow = np.array([p.of_slow_error for p in problem.parameters])
    joints = np.array([p.joint for p in problem.parameters])
    for _ in range(_SIZINGS):
        blocks = replace(blocks, prior=problem.correlated / prior**2)
        square = (fit.x + blocks.step) ** 2 + blocks.spread
        for i in set(joints[slow].tolist()):
            of_joint = slow & (joints == i)
            size = np.sqrt(np.mean(square[of_joint]))
            prior[of_joint] = np.clip(size, _LEAST_SLOW, _MOST_SLOW)
    parameters = zip(problem.parameters, prior.tolist(), strict=True)
    return replace(problem, parameters=tuple(replace(p, prior=size) for p, size in parameters))


def identifiable(fit: MotionExperiment) -> np.ndarray:
    """Return the mask of parameters of a fit that the recordings identify, (P,).

    What an interval does not bound to its usual size, or, of what is not negative, away from none, stays
    as in the start, the widest first; the others answer, to first order.  What is known before is not
    left out: it is between start and recordings.
    """
    has_prior = fit.problem.prior > 0.0
    chosen = np.ones(len(fit.x), dtype=bool)
    away = fit.problem.start - fit.x
    while chosen.any():
        blocks = fit.blocks.only(chosen, away)
        x = fit.x[chosen] + blocks.step
        width = blocks.half * blocks.deviation / _allowed(fit.problem.only(chosen), x)
        width[has_prior[chosen]] = 0.0
        worst = int(np.argmax(width))
        if width[worst] <= 1.0:
            break
        chosen[np.flatnonzero(chosen)[worst]] = False
    return chosen


def narrow(fit: MotionExperiment) -> np.ndarray:
    """Return the mask of parameters with an interval as narrow as `identifiable` asks, (P,)."""
    width = fit.blocks.half * fit.blocks.deviation / _allowed(fit.problem, fit.x)
    of_slow_error = [p.of_slow_error for p in fit.problem.parameters]
    return np.asarray(width <= 1.0) & ~np.array(of_slow_error, dtype=bool)


def returns(fit: MotionExperiment, chosen: np.ndarray) -> np.ndarray:
    """Return which parameters, (P,), stay if the fit is repeated from the ends of intervals.

    Where the squares are flat or rugged, or have other minima nearly as likely, it ends elsewhere: the
    value is one of several, and its interval is too narrow.

    Args:
        chosen: Mask of parameters whose intervals are tried, (P,).
    """
    half = fit.blocks.half * fit.blocks.deviation
    stays, least = np.ones(len(fit.x), dtype=bool), fit.minus_log_likelihood
    for k in np.flatnonzero(chosen):
        others = np.arange(len(fit.x)) != k
        for end in (-1.0, 1.0):
            x = np.where(others, fit.x, fit.x + end * half)
            x = np.clip(x, *fit.problem.bounds)
            x[others] += fit.blocks.only(others, x - fit.x).step
            back = fit_roughly(fit.problem, x)
            if back.minus_log_likelihood < least + SUPPORTED:
                stays &= np.abs(back.x - fit.x) <= _BACK * half
    return stays


def _allowed(problem: MotionProblem, x: np.ndarray) -> np.ndarray:
    """Return half of the widest interval of an identifiable parameter, (P,)."""
    allowed = np.where([p.signed for p in problem.parameters], 1.0, np.clip(x, 1e-9, 1.0))
    for k, p in enumerate(problem.parameters):
        if p.vanishes:
            allowed[k] = _NARROW
        if p.sensor:
            allowed[k] = max(_OF_ITSELF * abs(x[k]), _NARROW)
    return allowed
