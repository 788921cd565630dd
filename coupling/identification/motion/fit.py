"""The fit to recordings: what makes them likeliest, restarts, and which backlashes they support."""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np
from scipy.linalg import solve_triangular

from coupling.errors import SimulationError
from coupling.identification.estimate import CONVERGED, estimate
from coupling.identification.least_squares import reduced_rows
from coupling.identification.motion.derivatives import GearSlopes, derivatives, jacobian
from coupling.identification.motion.normal_blocks import NormalBlocks
from coupling.identification.motion.problem import MotionPoint, MotionProblem

# Steps of a fit at most, and of one that only shows where it leads.
_STEPS, _FIRST_STEPS = 60, 6
# Predicted gain of log likelihood by the next step below which a fit ends.
_SETTLED = 1e-4
# Damping of directions that are not observable, in parts of the columns' squares.
_UNOBSERVABLE = 1e-9
# Compliance that another fit starts from, in parts of what the first one gave.
_STIFF = 0.1
# A backlash is supported by recordings that are likelier by e to this with it: an interval of 95 %.
SUPPORTED = 2.0
# Size of slow errors, over the usual one, at least and at most: data sheets do not allow more.  Steps to
# the likeliest.
_LEAST_SLOW, _MOST_SLOW, _SIZINGS = 0.01, 1.0, 60


@dataclass(frozen=True)
class MotionExperiment:
    """Recordings around values of the parameters, with derivatives of their residuals.

    Attributes:
        point: Predictions and weights of these values.
        slopes: Derivatives of the gears' motion there; nearby, unless they are exact.
        converged: Whether a fit has converged there.
    """

    point: MotionPoint
    slopes: GearSlopes
    converged: bool = False

    @property
    def problem(self) -> MotionProblem:
        """Parameters and recordings."""
        return self.point.problem

    @property
    def x(self) -> np.ndarray:
        """Values as the fit counts, parts of usual sizes [1], (P,)."""
        return self.point.x

    @cached_property
    def rows(self) -> tuple[np.ndarray, np.ndarray]:
        """Derivatives, (P, P), and residual, (P,), of all rows and the prior, reduced to P rows.

        A direction that is not observable is damped, so that it stays.
        """
        problem, x = self.problem, self.x
        products, gradient = np.diag(problem.prior), problem.prior * (x - problem.start)
        residuals = self.point.residuals(self.point)
        for channel in derivatives(self.point, self.slopes):
            numbers, columns = channel.numbers, channel.columns
            products[np.ix_(numbers, numbers)] += columns @ columns.T
            gradient[numbers] += columns @ residuals[channel.recording][:, channel.channel]
        return reduced_rows(products, gradient, _UNOBSERVABLE)

    @property
    def unit(self) -> float:
        """Number of rows that count as one."""
        return self.problem.correlated

    @property
    def is_exact(self) -> bool:
        """Whether the gears' derivatives were simulated at x."""
        return self.slopes.exact

    def cost(self, weighted: MotionExperiment) -> float:
        """Return half the squares of residuals and prior [1], with the weights around other values."""
        residuals = weighted.point.residuals(self.point)
        prior = self.problem.prior @ (self.x - self.problem.start) ** 2
        return 0.5 * float(prior + sum(np.sum(rows**2) for rows in residuals))

    def at(self, x: np.ndarray) -> MotionExperiment | None:
        """Return the recordings around other values [1], (P,); None too far for the solver.

        Derivatives are those that explain the step [Broyden1965].
        """
        try:
            point = MotionPoint.of(self.problem, x)
        except SimulationError:
            return None
        before, after = (
            [predicted.gears.rows for predicted in recordings.predicted]
            for recordings in (self.point, point)
        )
        moving = np.array([p.moves_gears for p in self.problem.parameters], dtype=bool)
        effect = np.linalg.norm(self.rows[0][:, moving], axis=0)
        return MotionExperiment(
            point, self.slopes.changed((x - self.x)[moving], effect, before, after)
        )

    def recompute(self) -> MotionExperiment:
        """Return the same with derivatives simulated at x."""
        return replace(self, slopes=GearSlopes.of(self.point))

    @cached_property
    def blocks(self) -> NormalBlocks:
        """Its normal equations, block by block."""
        problem, slopes = self.problem, self.slopes
        if not slopes.exact:
            slopes = GearSlopes.of(self.point)
        residuals = self.point.residuals(self.point)
        blocks = NormalBlocks.of(jacobian(self.point, slopes), residuals)
        away = problem.start - self.x
        return replace(blocks, prior=problem.prior, away=away, correlated=problem.correlated)


def fit_motion(
    problem: MotionProblem,
    x: np.ndarray | None = None,
    near: GearSlopes | None = None,
    steps: int = _STEPS,
    settled: float = _SETTLED,
) -> MotionExperiment:
    """Return the fit of a problem's parameters.

    Weights of channels, the state of friction and loops are those of the last step.  Derivatives of the
    gears' motion are kept up by steps that gain as predicted, and simulated where they do not or end.

    Args:
        x: Values to begin with [1], (P,); None: those of the start.
        near: Derivatives of the gears' motion near them; None: they are simulated.
        steps: Steps at most.
        settled: Predicted gain of log likelihood below which it ends.
    """
    x = np.clip(_solve_sensors(problem) if x is None else x, *problem.bounds)
    point = MotionPoint.of(problem, x)
    start = MotionExperiment(point, GearSlopes.of(point, near), converged=True)
    if not len(x):
        return start
    estimated = estimate(start, problem.bounds, steps, settled)
    return replace(estimated.experiment, converged=estimated.converged)


def _solve_sensors(problem: MotionProblem) -> np.ndarray:
    """Return the start with the sensors' numbers solved for, (P,): linear, and a lag nearly."""
    of_sensor = np.array([bool(p.sensor) for p in problem.parameters], dtype=bool)
    x = problem.start.copy()
    if of_sensor.any():
        point = MotionPoint.of(problem.only(of_sensor), x[of_sensor])
        x[of_sensor] -= solve_triangular(*MotionExperiment(point, GearSlopes.of(point)).rows)
    return np.clip(x, *problem.bounds)


def fit_roughly(
    problem: MotionProblem, x: np.ndarray | None = None, near: GearSlopes | None = None
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
        if restarted.point.minus_log_likelihood < best.point.minus_log_likelihood:
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
        least = MotionPoint.of(wider, without).minus_log_likelihood
        if least - tried.point.minus_log_likelihood > SUPPORTED:
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
