"""The fit to recordings: what makes them likeliest, restarts, and which backlashes they support."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np
from scipy.linalg import cholesky, solve_triangular

from coupling.errors import SimulationError
from coupling.identification.estimate import CONVERGED, Trial, estimate
from coupling.identification.motion.derivatives import GearSlopes, derivatives, jacobian
from coupling.identification.motion.normal_blocks import NormalBlocks
from coupling.identification.motion.problem import MotionProblem, Predicted
from coupling.identification.motion.sensors import SensorParameter

# Steps of a fit at most, and of one that only shows where it leads.
_STEPS, _FIRST_STEPS = 60, 6
# Predicted gain of log likelihood by the next step below which a fit ends.
_SETTLED = 1e-4
# Damping of directions that are not observable, in parts of the columns' squares.
_UNOBSERVABLE = 1e-9
# A channel weighs at most so many times as much as its measured size says.
_LEAST_PART = 1e-3
# What is left of a channel counts as this at least [rad, N m]: below is rounding.
_EXACT = 1e-9
# Compliance that another fit starts from, in parts of what the first one gave.
_STIFF = 0.1
# A backlash is supported by recordings that are likelier by e to this with it: an interval of 95 %.
SUPPORTED = 2.0
# Size of slow errors, over the usual one, at least and at most: data sheets do not allow more.  Steps to
# the likeliest.
_LEAST_SLOW, _MOST_SLOW, _SIZINGS = 0.01, 1.0, 60


@dataclass(frozen=True)
class MotionTrial:
    """Predictions that were tried.

    Attributes:
        x: Values as the fit counts [1], (P,).
        predicted: Predictions of all recordings there.
        cost: Half the squares that they leave [1].
    """

    x: np.ndarray
    predicted: tuple[Predicted, ...]
    cost: float


@dataclass(frozen=True)
class MotionLinearisation:
    """Recordings around values of the parameters.

    Attributes:
        problem: The problem with weights, state of friction and loops of these values.
        x: Values as the fit counts, parts of usual sizes [1], (P,).
        slopes: Derivatives of the gears' motion there; nearby, unless they are exact.
    """

    problem: MotionProblem
    x: np.ndarray
    slopes: GearSlopes

    @cached_property
    def rows(self) -> tuple[np.ndarray, np.ndarray]:
        """Derivatives, (P, P), and residual, (P,), of all rows and the prior, reduced to P rows.

        A direction that is not observable is damped, so that it stays.
        """
        problem, x = self.problem, self.x
        products, gradient = np.diag(problem.prior), problem.prior * (x - problem.start)
        residuals = problem.residuals_of(problem.loaded)
        for channel in derivatives(problem, x, self.slopes):
            numbers, columns = channel.numbers, channel.columns
            products[np.ix_(numbers, numbers)] += columns @ columns.T
            gradient[numbers] += columns @ residuals[channel.recording][:, channel.channel]
        size = np.sqrt(np.diag(products))
        size[size == 0.0] = 1.0
        scaled = products / np.outer(size, size) + _UNOBSERVABLE * np.eye(len(x))
        matrix = cholesky(scaled) * size
        return matrix, solve_triangular(matrix, gradient, trans="T")

    @cached_property
    def cost(self) -> float:
        """Half the squares of residuals and prior [1]."""
        return self._cost(self.x, self.problem.loaded)

    @property
    def unit(self) -> float:
        """Number of rows that count as one."""
        return self.problem.correlated

    @property
    def is_exact(self) -> bool:
        """Whether the gears' derivatives were simulated at x."""
        return self.slopes.exact

    def _cost(self, x: np.ndarray, predicted: Iterable[Predicted]) -> float:
        problem = self.problem
        prior = problem.prior @ (x - problem.start) ** 2
        residuals = problem.residuals_of(predicted)
        return 0.5 * float(prior + sum(np.sum(rows**2) for rows in residuals))

    def try_step(self, step: np.ndarray) -> MotionTrial | None:
        """Return the predictions after a step [1], (P,); None where it leads too far for the solver."""
        x = self.x + step
        try:
            predicted = self.problem.predictions(x)
        except SimulationError:
            return None
        return MotionTrial(x, predicted, self._cost(x, predicted))

    def move_to(self, trial: Trial) -> MotionLinearisation:
        """Return the recordings around a trial, with derivatives that explain the step [Broyden1965]."""
        assert isinstance(trial, MotionTrial)
        before, after = (
            [predicted.gears.rows for predicted in recordings]
            for recordings in (self.problem.loaded, trial.predicted)
        )
        moving = np.array([p.moves_gears for p in self.problem.parameters], dtype=bool)
        effect = np.linalg.norm(self.rows[0][:, moving], axis=0)
        slopes = self.slopes.changed((trial.x - self.x)[moving], effect, before, after)
        problem = reweigh(self.problem, trial.x, trial.predicted)
        return MotionLinearisation(problem, trial.x, slopes)

    def recompute(self) -> MotionLinearisation:
        """Return the same with derivatives simulated at x."""
        return replace(self, slopes=GearSlopes.of(self.problem, self.x))


@dataclass(frozen=True)
class MotionFit(MotionLinearisation):
    """Recordings around fitted values.

    Attributes:
        converged: Whether another step would make what was measured hardly likelier.
    """

    converged: bool

    @cached_property
    def blocks(self) -> NormalBlocks:
        """Its normal equations, block by block."""
        problem, x = self.problem, self.x
        slopes = self.slopes if self.slopes.exact else GearSlopes.of(problem, x)
        residual = np.vstack(problem.residuals_of(problem.loaded)).ravel()
        rows = [len(smoothed.recording.time) for smoothed in problem.recordings]
        blocks = NormalBlocks.of(jacobian(problem, x, slopes), residual, rows, problem.channels)
        away = problem.start - x
        return replace(blocks, prior=problem.prior, away=away, correlated=problem.correlated)


def fit_motion(
    problem: MotionProblem,
    x: np.ndarray | None = None,
    near: GearSlopes | None = None,
    steps: int = _STEPS,
    settled: float = _SETTLED,
) -> MotionFit:
    """Return the fit of a problem's parameters.

    Weights of channels, the state of friction and loops are those of the last step.  Derivatives of the
    gears' motion are kept up by steps that gain as predicted, and simulated where they do not or end.

    Args:
        problem: The problem.
        x: Values to begin with [1], (P,); None: those of the start.
        near: Derivatives of the gears' motion near them; None: they are simulated.
        steps: Steps at most.
        settled: Predicted gain of log likelihood below which it ends.
    """
    x = np.clip(_solve_sensors(problem) if x is None else x, *problem.bounds)
    problem = reweigh(problem, x)
    start = MotionLinearisation(problem, x, GearSlopes.of(problem, x, near))
    if not len(x):
        return MotionFit(problem, x, start.slopes, True)
    estimated = estimate(start, problem.bounds, steps, settled)
    point = estimated.linearisation
    return MotionFit(point.problem, point.x, point.slopes, estimated.converged)


def _solve_sensors(problem: MotionProblem) -> np.ndarray:
    """Return the start with the sensors' numbers solved for, (P,): linear, and a lag nearly."""
    of_sensor = np.array([isinstance(p, SensorParameter) for p in problem.parameters], dtype=bool)
    x = problem.start.copy()
    if of_sensor.any():
        sensors = reweigh(problem.only(of_sensor), x[of_sensor])
        slopes = GearSlopes.of(sensors, x[of_sensor])
        x[of_sensor] -= solve_triangular(*MotionLinearisation(sensors, x[of_sensor], slopes).rows)
    return np.clip(x, *problem.bounds)


def fit_roughly(
    problem: MotionProblem, x: np.ndarray | None = None, near: GearSlopes | None = None
) -> MotionFit:
    """Return the first steps of a fit, from x [1], (P,), with the arguments of `fit_motion`."""
    return fit_motion(problem, x, near, _FIRST_STEPS, CONVERGED)


def fit_with_restarts(problem: MotionProblem, first: MotionFit) -> MotionFit:
    """Return the likeliest of the fits from where a first one led, and from each gear stiffer in turn.

    An arm of another stiffness swings out of phase with what was measured, so that the squares have
    several minima, and least squares find the nearest.  Behind a stiff gear it hardly swings: from there
    they go down to the first.
    """
    best = fit_roughly(problem, first.x, first.slopes)
    least = minus_log_likelihood(problem, best.x)
    for k in np.flatnonzero([p.inverse for p in problem.parameters]):
        stiff = best.x.copy()
        stiff[k] *= _STIFF
        restarted = fit_roughly(problem, stiff, best.slopes)
        likelihood = minus_log_likelihood(problem, restarted.x)
        if likelihood < least:
            best, least = restarted, likelihood
    return fit_motion(problem, best.x, best.slopes)


def select_backlashes(problem: MotionProblem, fit: MotionFit) -> MotionFit:
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
        gain = minus_log_likelihood(wider, without) - minus_log_likelihood(wider, tried.x)
        if gain > SUPPORTED:
            none, fit = fewer, fit_motion(wider, tried.x, tried.slopes)
    return fit


def minus_log_likelihood(problem: MotionProblem, x: np.ndarray) -> float:
    """Return minus the logarithm of likelihood and prior at x [1], (P,), for channels of any size."""
    reweighted = reweigh(problem, x)
    rows = sum(len(smoothed.recording.time) for smoothed in problem.recordings) / problem.correlated
    deviation = np.concatenate([reweighted.wind_up_deviation, reweighted.torque_deviation])
    prior = 0.5 * problem.prior / problem.correlated @ (x - problem.start) ** 2
    return float(rows * np.sum(np.log(deviation[np.isfinite(deviation)])) + prior)


def estimate_slow_errors(fit: MotionFit) -> MotionProblem:
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
            of_joint = slow & (joints == i)
            size = np.sqrt(np.mean(square[of_joint]))
            prior[of_joint] = np.clip(size, _LEAST_SLOW, _MOST_SLOW)
    parameters = zip(problem.parameters, prior.tolist(), strict=True)
    return replace(problem, parameters=tuple(replace(p, prior=size) for p, size in parameters))


def reweigh(
    problem: MotionProblem, x: np.ndarray, there: Sequence[Predicted] = ()
) -> MotionProblem:
    """Return the problem with channels weighed by the rms of what is left of them at x [1], (P,).

    Args:
        there: Predictions at x with other friction; none: gears are simulated.
    """
    if there:
        pairs = zip(problem.recordings, there, strict=True)
        loaded = tuple(problem.reloaded(smoothed, x, predicted) for smoothed, predicted in pairs)
    else:
        loaded = tuple(problem.predicted(smoothed, x) for smoothed in problem.recordings)
    wind_up, torque = zip(*map(problem.residuals, problem.recordings, loaded), strict=True)
    measured = np.vstack([smoothed.recording.torque for smoothed in problem.recordings])
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
