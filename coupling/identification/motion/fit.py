"""Least squares over simulations: the likeliest robot, and what its recordings support."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from contextlib import suppress
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np
from scipy.linalg import cholesky, solve_triangular
from scipy.optimize import lsq_linear

from coupling.errors import SimulationError
from coupling.identification.motion.derivatives import GearSlopes, derivatives, jacobian
from coupling.identification.motion.normal_blocks import NormalBlocks
from coupling.identification.motion.problem import MotionProblem, Predicted
from coupling.identification.motion.sensors import SensorParameter

# Steps of a fit at most, and of one that only looks where it leads.
_STEPS, _LOOKS = 60, 6
# Predicted gain of log likelihood by the next step below which a fit ends, and has converged.
_SETTLED, _CONVERGED = 1e-4, 1e-2
# A step that gains less than this part of the predicted gain is shortened: its damping, in parts of the
# columns' squares, where it is first needed, and the factor by which it grows.
_GAINS, _DAMPING, _GROWS = 0.1, 1e-2, 10.0
# Derivatives are simulated again after a step that gains less than this part of the predicted gain.
_TRUSTED = 0.5
# Damping of directions that are not observable, in the same parts.
_UNOBSERVABLE = 1e-9
# A channel weighs at most so many times as much as its measured size says.
_LEAST_PART = 1e-3
# What is left of a channel counts as this at least [rad, N m]: below is rounding.
_EXACT = 1e-9
# Compliance that another fit starts from, in parts of what the first one found.
_STIFF = 0.1
# A backlash is supported by recordings that are likelier by e to this with it: an interval of 95 %.
SUPPORTED = 2.0
# Size of slow errors, over the usual one, at least and at most: data sheets do not allow more.  Steps to
# the likeliest.
_LEAST_SLOW, _MOST_SLOW, _SIZINGS = 0.01, 1.0, 60


@dataclass(frozen=True)
class MotionFit:
    """A fitted robot.

    Attributes:
        problem: The problem with the last weights.
        x: Values as the fit counts, parts of usual sizes [1], (P,).
        converged: Whether another step would make what was measured hardly likelier.
        slopes: Derivatives of the gears' motion there; nearby, unless they are exact.
    """

    problem: MotionProblem
    x: np.ndarray
    converged: bool
    slopes: GearSlopes

    @cached_property
    def blocks(self) -> NormalBlocks:
        """Its normal equations, block by block."""
        problem, x = self.problem, self.x
        slopes = self.slopes if self.slopes.exact else GearSlopes.of(problem, x)
        residual = np.vstack(problem.residuals_of(problem.loaded)).ravel()
        rows = [len(moved.recording.time) for moved in problem.moved]
        blocks = NormalBlocks.of(jacobian(problem, x, slopes), residual, rows, problem.channels)
        away = problem.start - x
        return replace(blocks, prior=problem.prior, away=away, correlated=problem.correlated)


def fitted(
    problem: MotionProblem,
    x: np.ndarray | None = None,
    near: GearSlopes | None = None,
    steps: int = _STEPS,
    settled: float = _SETTLED,
) -> MotionFit:
    """Return the fit of a problem's parameters.

    Gauss-Newton between the bounds, damped where a step gains less than predicted (Marquardt).
    Weights of channels, the state of friction and loops are those of the last step.  Derivatives of the
    gears' motion are kept up by steps that gain as predicted, and simulated where they do not or end.

    Args:
        problem: The problem.
        x: Values to begin with [1], (P,); None: those of the start.
        near: Derivatives of the gears' motion near them; None: they are simulated.
        steps: Steps at most.
        settled: Predicted gain of log likelihood below which it ends.
    """
    lowest, highest = problem.bounds
    x = np.clip(_with_beside(problem, problem.start) if x is None else x, lowest, highest)
    problem, damping, predicted = reweighed(problem, x), 0.0, 0.0
    slopes = GearSlopes.of(problem, x, near)
    moving = np.array([p.moves_gears for p in problem.parameters], dtype=bool)
    rows = _turned(problem, x, slopes) if len(x) else None
    while rows is not None:
        matrix, rest, before = rows
        step, gain = _step(matrix, rest, lowest - x, highest - x, damping)
        predicted = predicted if damping else gain
        settles = gain < settled * problem.correlated
        if (settles and slopes.exact) or not steps:
            break
        gained, there = -np.inf, problem.loaded
        if not settles:
            steps -= 1
            with suppress(SimulationError):  # a step that leads too far for the solver
                there = problem.predictions(x + step)
                gained = before - _squares(problem, x + step, there)
        if gained > _GAINS * gain:
            earlier, now = ([one.gears.rows for one in own] for own in (problem.loaded, there))
            effect = np.linalg.norm(matrix[:, moving], axis=0)
            slopes = slopes.changed(step[moving], effect, earlier, now)
            x = x + step
            damping = damping / _GROWS if damping > _DAMPING else 0.0
            problem = reweighed(problem, x, there)
            if gained < _TRUSTED * gain:
                slopes = GearSlopes.of(problem, x)
        elif not slopes.exact:
            slopes = GearSlopes.of(problem, x)
        else:
            damping = max(_GROWS * damping, _DAMPING)
            continue
        rows = _turned(problem, x, slopes)
    converged = slopes.exact and predicted < _CONVERGED * problem.correlated
    return MotionFit(problem, x, converged, slopes)


def _step(
    matrix: np.ndarray, rest: np.ndarray, low: np.ndarray, high: np.ndarray, damping: float
) -> tuple[np.ndarray, float]:
    """Return the damped step between bounds, (P,), and the predicted decrease of half of the squares."""
    damped = np.vstack([matrix, np.diag(np.sqrt(damping) * np.linalg.norm(matrix, axis=0))])
    target = np.concatenate([-rest, np.zeros(len(low))])
    step = np.clip(lsq_linear(damped, target, (low, high + 1e-12), method="bvls").x, low, high)
    left = rest + matrix @ step
    return step, float(0.5 * (rest @ rest - left @ left))


def _with_beside(problem: MotionProblem, x: np.ndarray) -> np.ndarray:
    """Return x with what is beside the model solved for: it is linear, and the lag nearly."""
    own = np.array([isinstance(p, SensorParameter) for p in problem.parameters], dtype=bool)
    if not own.any():
        return x
    beside = reweighed(problem.only(own), x[own])
    matrix, rest, _ = _turned(beside, x[own], GearSlopes.of(beside, x[own]))
    found = x.copy()
    found[own] -= solve_triangular(matrix, rest)
    return np.clip(found, *problem.bounds)


def looked(
    problem: MotionProblem, x: np.ndarray | None = None, near: GearSlopes | None = None
) -> MotionFit:
    """Return the first steps of a fit, from x [1], (P,), with the arguments of `fitted`."""
    return fitted(problem, x, near, _LOOKS, _CONVERGED)


def likeliest(problem: MotionProblem, first: MotionFit) -> MotionFit:
    """Return the likeliest of the fits from where a first one led, and from each gear stiffer in turn.

    An arm of another stiffness swings out of phase with what was measured, so that the squares have
    several minima, and least squares find the nearest.  Behind a stiff gear it hardly swings: from there
    they go down to the first.
    """
    found = looked(problem, first.x, first.slopes)
    least = unlikely(problem, found.x)
    for k in np.flatnonzero([p.inverse for p in problem.parameters]):
        stiff = found.x.copy()
        stiff[k] *= _STIFF
        other = looked(problem, stiff, found.slopes)
        likely = unlikely(problem, other.x)
        if likely < least:
            found, least = other, likely
    return fitted(problem, found.x, found.slopes)


def supported(problem: MotionProblem, fit: MotionFit) -> MotionFit:
    """Return a fit with those backlashes of a problem that the recordings support, the others none.

    An unloaded link moves in its backlash in a way that no recording determines: the squares are then
    rugged along all parameters, and the end of a fit depends on the last digits of the measurement.

    Args:
        problem: The problem with all parameters.
        fit: The fit without any backlash.
    """
    gone = np.array([p.vanishes for p in problem.parameters], dtype=bool)
    for k in np.flatnonzero(gone):
        tried = gone & (np.arange(len(gone)) != k)
        wider = problem.without(tried)
        values = dict(zip((p.name for p in fit.problem.parameters), fit.x.tolist(), strict=True))
        none = np.array([values.get(p.name, 0.0) for p in wider.parameters])
        own = np.array([p.name not in values for p in wider.parameters])
        found = looked(wider, np.where(own, wider.start, none), fit.slopes)
        if unlikely(wider, none) - unlikely(wider, found.x) > SUPPORTED:
            gone, fit = tried, fitted(wider, found.x, found.slopes)
    return fit


def unlikely(problem: MotionProblem, x: np.ndarray) -> float:
    """Return minus the logarithm of likelihood and prior at x [1], (P,), for channels of any size."""
    sizes = reweighed(problem, x)
    rows = sum(len(moved.recording.time) for moved in problem.moved) / problem.correlated
    deviation = np.concatenate([sizes.wind_up_deviation, sizes.torque_deviation])
    away = 0.5 * problem.prior / problem.correlated @ (x - problem.start) ** 2
    return float(rows * np.sum(np.log(deviation[np.isfinite(deviation)])) + away)


def sized(fit: MotionFit) -> MotionProblem:
    """Return a fit's problem with the size of slow errors that its recordings make likeliest.

    Expectation maximisation of the marginal likelihood (evidence, [MacKay1992]),
    joint by joint, all parameters to first order.
    """
    problem, blocks = fit.problem, fit.blocks
    prior = np.array([p.prior for p in problem.parameters])
    slow = np.array(
        [isinstance(p, SensorParameter) and p.of_slow_error for p in problem.parameters]
    )
    joints = np.array([p.joint for p in problem.parameters])
    for _ in range(_SIZINGS):
        blocks = replace(blocks, prior=problem.correlated / prior**2)
        square = (fit.x + blocks.step) ** 2 + blocks.spread
        for i in set(joints[slow].tolist()):
            own = slow & (joints == i)
            prior[own] = np.clip(np.sqrt(np.mean(square[own])), _LEAST_SLOW, _MOST_SLOW)
    parameters = zip(problem.parameters, prior.tolist(), strict=True)
    return replace(problem, parameters=tuple(replace(p, prior=own) for p, own in parameters))


def _squares(problem: MotionProblem, x: np.ndarray, predicted: Iterable[Predicted]) -> float:
    """Return half of all squares [1] by predictions at x [1], (P,), with what is known before."""
    known = problem.prior @ (x - problem.start) ** 2
    return 0.5 * float(known + sum(np.sum(own**2) for own in problem.residuals_of(predicted)))


def _turned(
    problem: MotionProblem, x: np.ndarray, slopes: GearSlopes
) -> tuple[np.ndarray, np.ndarray, float]:
    """Return derivatives, (P, P), and residual, (P,), of rows turned to P, and half of all squares [1].

    Products of the derivatives with each other and with the residual are all that least squares need.
    A direction that is not observable is damped, so that it stays.
    """
    products, gradient = np.diag(problem.prior), problem.prior * (x - problem.start)
    left = problem.residuals_of(problem.loaded)
    for own in derivatives(problem, x, slopes):
        products[np.ix_(own.numbers, own.numbers)] += own.columns @ own.columns.T
        gradient[own.numbers] += own.columns @ left[own.recording][:, own.channel]
    size = np.sqrt(np.diag(products))
    size[size == 0.0] = 1.0
    scaled = products / np.outer(size, size) + _UNOBSERVABLE * np.eye(len(x))
    turned = cholesky(scaled) * size
    rest = solve_triangular(turned, gradient, trans="T")
    return turned, rest, _squares(problem, x, problem.loaded)


def reweighed(
    problem: MotionProblem, x: np.ndarray, there: Sequence[Predicted] = ()
) -> MotionProblem:
    """Return the problem with channels weighed by the rms of what is left of them at x [1], (P,).

    Args:
        there: Predictions at x with other friction; none: gears are simulated.
    """
    if there:
        pairs = zip(problem.moved, there, strict=True)
        loaded = tuple(problem.reloaded(moved, x, own) for moved, own in pairs)
    else:
        loaded = tuple(problem.predicted(moved, x) for moved in problem.moved)
    wind_up, torque = zip(*map(problem.left, problem.moved, loaded), strict=True)
    measured = np.vstack([moved.recording.torque for moved in problem.moved])
    least = _LEAST_PART * rms(measured)
    return replace(
        problem,
        wind_up_deviation=np.maximum(rms(np.vstack(wind_up)), _EXACT),
        torque_deviation=np.maximum(rms(np.vstack(torque)), np.maximum(least, _EXACT)),
        loaded=loaded,
    )


def rms(values: np.ndarray) -> np.ndarray:
    """Return the rms of columns (n, k), any unit, (k,); nan where one holds nan."""
    return np.sqrt(np.mean(values**2, axis=0))
