"""Least squares over simulations, and which of its parameters are identifiable."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace

import numpy as np
from scipy.optimize import least_squares

from coupling.identification.motion.normal_blocks import NormalBlocks
from coupling.identification.motion.problem import MotionProblem
from coupling.identification.motion.sensors import SensorParameter

# Iterations, each with the channels weighed by what is left of them: most steps, and what settles them.
_ITERATIONS = ((5, 1e-2), (8, 1e-4))
# The solver starts so far inside its bounds.
_INSIDE = 1e-6
# An encoder's error is identifiable with an interval below this part of itself, or of its usual size,
# which shows that there is none.
_OF_ITSELF, _NARROW = 1.0, 0.3
# A channel weighs at most so many times as much as its measured size says.
_LEAST_PART = 1e-3
# What is left of a channel counts as this at least [rad, N m]: below is rounding.
_EXACT = 1e-9
# Compliance that another fit starts from, in parts of what the first one found.
_STIFF = 0.1
# Size of slow errors, over the usual one, at least and at most: data sheets do not allow more.  Steps to
# the likeliest.
_LEAST_SLOW, _MOST_SLOW, _SIZINGS = 0.01, 1.0, 60


@dataclass(frozen=True)
class MotionFit:
    """A fitted robot.

    Attributes:
        problem: The problem with the last weights.
        x: Values as the fit counts, parts of usual sizes [1], (P,).
        blocks: Its normal equations, block by block.
        converged: Whether the last step moved nothing.
    """

    problem: MotionProblem
    x: np.ndarray
    blocks: NormalBlocks
    converged: bool


def fitted(
    problem: MotionProblem,
    x: np.ndarray | None = None,
    iterations: tuple[tuple[int, float], ...] = _ITERATIONS,
) -> MotionFit:
    """Return the fit of a problem's parameters, from given values [1], (P,), or those of the start."""
    if x is None:
        x = _with_beside(problem, problem.start)
    converged = True
    for most, settled in iterations:
        problem = reweighed(problem, x)
        if not len(x):
            break
        lowest, highest = problem.bounds
        residual, jacobian = _with_prior(problem)
        found = least_squares(
            residual,
            np.clip(x, lowest + _INSIDE, highest - _INSIDE),
            jacobian,
            bounds=(lowest, highest),
            x_scale=1.0,
            max_nfev=most,
            xtol=settled,
            ftol=settled,
        )
        x, converged = found.x, found.status > 0
    return MotionFit(problem, x, _blocks(problem, x), converged)


def _with_beside(problem: MotionProblem, x: np.ndarray) -> np.ndarray:
    """Return x with what is beside the model solved for: it is linear, and the lag nearly."""
    own = np.array([isinstance(p, SensorParameter) for p in problem.parameters], dtype=bool)
    if not own.any():
        return x
    beside = reweighed(problem, x).only(own)
    residual, jacobian = _with_prior(beside)
    step = np.linalg.lstsq(jacobian(x[own]), -residual(x[own]), rcond=1e-9)[0]
    found = x.copy()
    found[own] += step
    return np.clip(found, *problem.bounds)


def likeliest(problem: MotionProblem, x: np.ndarray) -> MotionFit:
    """Return the likeliest of the fits from values x [1], (P,), and from each gear stiffer in turn.

    An arm of another stiffness swings out of phase with what was measured, so that the squares have
    several minima, and least squares find the nearest.  Behind a stiff gear it hardly swings: from there
    they go down to the first.
    """
    found = fitted(problem, x)
    least = unlikely(problem, found.x)
    for k in np.flatnonzero([p.inverse for p in problem.parameters]):
        stiff = found.x.copy()
        stiff[k] *= _STIFF
        other = fitted(problem, stiff, _ITERATIONS[:1])
        if unlikely(problem, other.x) < least:
            found = fitted(problem, other.x)
            least = unlikely(problem, found.x)
    return found


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


def _with_prior(
    problem: MotionProblem,
) -> tuple[Callable[[np.ndarray], np.ndarray], Callable[[np.ndarray], np.ndarray]]:
    """Return residual and derivatives by x, with rows of what is known before beneath."""
    root, start = np.sqrt(problem.prior), problem.start
    return (
        lambda x: np.concatenate([problem.residual(x), root * (x - start)]),
        lambda x: np.vstack([problem.jacobian(x), np.diag(root)]),
    )


def reweighed(problem: MotionProblem, x: np.ndarray) -> MotionProblem:
    """Return the problem with channels weighed by the rms of what is left of them at x [1], (P,)."""
    wind_up, torque = [], []
    for moved in problem.moved:
        left = problem.left(moved, problem.predicted(moved, x))
        wind_up.append(left[0])
        torque.append(left[1])
    measured = np.vstack([moved.recording.torque for moved in problem.moved])
    least = _LEAST_PART * rms(measured)
    return replace(
        problem,
        wind_up_deviation=np.maximum(rms(np.vstack(wind_up)), _EXACT),
        torque_deviation=np.maximum(rms(np.vstack(torque)), np.maximum(least, _EXACT)),
    )


def rms(values: np.ndarray) -> np.ndarray:
    """Return the rms of columns (n, k), any unit, (k,); nan where one holds nan."""
    return np.sqrt(np.mean(values**2, axis=0))


def _blocks(problem: MotionProblem, x: np.ndarray) -> NormalBlocks:
    residual, jacobian = problem.residual(x), problem.jacobian(x)
    rows = [len(moved.recording.time) for moved in problem.moved]
    blocks = NormalBlocks.of(jacobian, residual, rows, len(residual) // sum(rows))
    away = problem.start - x
    return replace(blocks, prior=problem.prior, away=away, correlated=problem.correlated)


def identifiable(fit: MotionFit) -> np.ndarray:
    """Return the mask of parameters of a fit that the recordings identify, (P,).

    What an interval does not bound to its usual size, or, of what is not negative, away from none, stays
    as in the start, the widest first; the others answer, to first order.  What is known before is not
    left out: it is between start and recordings.
    """
    known = fit.problem.prior > 0.0
    chosen = np.ones(len(fit.x), dtype=bool)
    away = fit.problem.start - fit.x
    while chosen.any():
        blocks = fit.blocks.only(chosen, away)
        x = fit.x[chosen] + blocks.step
        width = blocks.half * blocks.deviation / _allowed(fit.problem.only(chosen), x)
        width[known[chosen]] = 0.0
        worst = int(np.argmax(width))
        if width[worst] <= 1.0:
            break
        chosen[np.flatnonzero(chosen)[worst]] = False
    return chosen


def narrow(fit: MotionFit) -> np.ndarray:
    """Return the mask of parameters with an interval as narrow as `identifiable` asks, (P,)."""
    width = fit.blocks.half * fit.blocks.deviation / _allowed(fit.problem, fit.x)
    own = [isinstance(p, SensorParameter) and p.of_slow_error for p in fit.problem.parameters]
    return np.asarray(width <= 1.0) & ~np.array(own, dtype=bool)


def _allowed(problem: MotionProblem, x: np.ndarray) -> np.ndarray:
    """Return half of the widest interval of an identifiable parameter, (P,)."""
    allowed = np.where([p.signed for p in problem.parameters], 1.0, np.clip(x, 1e-9, 1.0))
    for k, p in enumerate(problem.parameters):
        if p.vanishes:
            allowed[k] = _NARROW
        if isinstance(p, SensorParameter):
            allowed[k] = max(_OF_ITSELF * abs(x[k]), _NARROW)
    return allowed
