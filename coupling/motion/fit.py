"""The fit: least squares over simulations, what it tells, and what is kept because it does not."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
from scipy.optimize import least_squares

from coupling.motion.blocks import NormalBlocks
from coupling.motion.parameters import MotionParameter
from coupling.motion.problem import MotionProblem
from coupling.motion.sensors import SensorParameter

# Passes, each with the channels weighed by what is left of them: most steps, and what settles them.
_PASSES = ((5, 1e-2), (8, 1e-4))
# The solver starts so far inside its bounds.
_INSIDE = 1e-6
# What encoders add is told by an interval below this part of itself; one below this part of the usual
# size does no harm, and tells that there is none.
_TOLD, _NARROW = 1.0, 0.3
# A channel weighs at most so many times as much as its measured size says.
_LEAST_PART = 1e-3
# What is left of a channel counts as this at least [rad, N m]: below is rounding.
_EXACT = 1e-9


@dataclass(frozen=True)
class MotionFit:
    """A fitted robot.

    Attributes:
        problem: The problem with the last weights.
        x: What the fit counts, (P,).
        blocks: Its normal equations, block by block.
        converged: Whether the last step moved nothing.
    """

    problem: MotionProblem
    x: np.ndarray
    blocks: NormalBlocks
    converged: bool


def fitted(problem: MotionProblem, x: np.ndarray | None = None) -> MotionFit:
    """Return the fit of a problem's parameters, from given values or those of the start."""
    if x is None:
        x = _with_beside(problem, problem.start)
    converged = True
    for most, settled in _PASSES:
        problem = reweighed(problem, x)
        if not len(x):
            break
        lowest, highest = problem.bounds
        found = least_squares(
            problem.residual,
            np.clip(x, lowest + _INSIDE, highest - _INSIDE),
            problem.jacobian,
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
    step = np.linalg.lstsq(beside.jacobian(x[own]), -beside.residual(x[own]), rcond=1e-9)[0]
    found = x.copy()
    found[own] += step
    return np.clip(found, *problem.bounds)


def reweighed(problem: MotionProblem, x: np.ndarray) -> MotionProblem:
    """Return the problem with channels weighed by the rms of what is left of them at x."""
    wind_up, torque = [], []
    for moved in problem.moved:
        left = problem.left(moved, problem.predicted(moved, x))
        wind_up.append(left[0])
        torque.append(left[1])
    measured = np.vstack([moved.recording.torque for moved in problem.moved])
    least = _LEAST_PART * np.sqrt(np.mean(measured**2, axis=0))
    return replace(
        problem,
        wind_up_deviation=np.maximum(_rms(wind_up), _EXACT),
        torque_deviation=np.maximum(_rms(torque), np.maximum(least, _EXACT)),
    )


def _rms(parts: list[np.ndarray]) -> np.ndarray:
    """Return the rms of columns over all parts, nan where one has none."""
    size: np.ndarray = np.sqrt(np.mean(np.vstack(parts) ** 2, axis=0))
    return size


def _blocks(problem: MotionProblem, x: np.ndarray) -> NormalBlocks:
    residual, jacobian = problem.residual(x), problem.jacobian(x)
    rows = [len(moved.recording.time) for moved in problem.moved]
    return NormalBlocks.of(jacobian, residual, rows, len(residual) // sum(rows))


def told(fit: MotionFit) -> np.ndarray:
    """Return which parameters of a fit the recordings tell, (P,) of bool.

    What an interval does not bound to its usual size, or, of what is not negative, away from none, stays
    as in the start, the widest first; the others answer, to first order.
    """
    chosen = np.ones(len(fit.x), dtype=bool)
    away = fit.problem.start - fit.x
    while chosen.any():
        blocks = fit.blocks.only(chosen, away)
        x = fit.x[chosen] + blocks.step
        width = blocks.half * blocks.deviation / _allowed(fit.problem.only(chosen), x)
        worst = int(np.argmax(width))
        if width[worst] <= 1.0:
            break
        lost = fit.problem.parameters[np.flatnonzero(chosen)[worst]]
        for k, p in enumerate(fit.problem.parameters):
            # A sine without its cosine is no eccentricity.
            with_it = isinstance(lost, SensorParameter) and p.term == lost.term
            chosen[k] &= p is not lost and not with_it
    return chosen


def _allowed(problem: MotionProblem, x: np.ndarray) -> np.ndarray:
    """Return half of the widest interval that tells a parameter, (P,)."""
    allowed = np.where([p.signed for p in problem.parameters], 1.0, np.clip(x, 1e-9, 1.0))
    for k, p in enumerate(problem.parameters):
        if isinstance(p, MotionParameter) and p.vanishes:
            allowed[k] = _NARROW
    for term in {p.term for p in problem.parameters if isinstance(p, SensorParameter)}:
        own = np.array([p.term == term for p in problem.parameters])
        allowed[own] = np.maximum(_TOLD * np.linalg.norm(x[own]), _NARROW)
    return allowed
