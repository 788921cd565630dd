"""The fit to frequency responses: linearisations, restarts over a common factor, noise, intervals."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from coupling.files.modal_damping import with_damping_ratio
from coupling.identification.estimate import Estimate, estimate
from coupling.identification.response.experiment import (
    DELAY,
    PostureResponse,
    ResponseExperiment,
    ResponseProblem,
)
from coupling.identification.response.posture import (
    DELAY_DEVIATION,
    FACTOR_DEVIATION,
    MeasuredPosture,
)
from coupling.modes.locked_robot import LockedRobot
from coupling.robot.parameters import apply_values
from elastic_robot.chain import build_chain
from elastic_robot.description import Robot
from elastic_robot.parameters import Parameters

# Standard deviations of the logs that are known before: a data sheet's or a class's stiffness, and a
# damping ratio of 0.04, which measured robots have within a factor of 2 to 3 [1].
_STIFFNESS, _DAMPING, _RATIO = 0.4, 1.0, 0.04
# Times that the robot is linearised: under its weight it rests elsewhere with other springs.
_LINEARISED = 3
# Common factors of all stiffnesses that the fit may start from.
_FACTORS = (0.5, 0.63, 0.8, 1.0, 1.25, 1.6, 2.0)
# Standard deviation of the residual before it is estimated, and the least: peaks that are elsewhere;
# and what no linearisation of a robot is better than [1].
_FIRST, _LEAST = 0.5, 0.01
# Times that it is estimated, steps of each fit at most, and predicted gain that ends it.
_ROUNDS, _MOST_STEPS, _SETTLED = 3, 60, 1e-4
# Logs of factors at most [1].
_FARTHEST = 4.0
# Weight above which a value is not of a valley [1].
_PEAKS = 0.7
# Median of |r| of normal r, in standard deviations.
_MEDIAN = 0.6745


@dataclass(frozen=True)
class ResponseFit(Estimate[ResponseExperiment]):
    """Fitted parameters.

    Attributes:
        deviation: Standard deviations of the parameters, their units, (P,).
        residual: Standard deviation of the real and imaginary residuals [1].
        noise: Standard deviation of the noise in them [1].
        postures: The robot in all postures, those held out as well.
        unloaded: Numbers of the joints in each of them whose gears are in their backlash.
    """

    deviation: np.ndarray
    residual: float
    noise: float
    postures: tuple[PostureResponse, ...] = ()
    unloaded: tuple[tuple[int, ...], ...] = ()

    @property
    def discrepancy(self) -> float:
        """Standard deviation of what the model does not describe [1]."""
        return float(np.sqrt(max(self.residual**2 - self.noise**2, 0.0)))

    @property
    def problem(self) -> ResponseProblem:
        """The responses that were fitted."""
        return self.experiment.problem

    @property
    def values(self) -> np.ndarray:
        """Fitted stiffnesses and dampings [N m/rad, N m s/rad], (2 m,)."""
        return np.concatenate(self.problem.parameters(self.x))


def fit_robot(robot: Robot, torque_curve: str, measured: Sequence[MeasuredPosture]) -> ResponseFit:
    """Fit a robot, linearised where it rests with fitted springs.

    Args:
        robot: The start, with elastic joints.
        torque_curve: A name of `TORQUE_CURVES`.
        measured: Postures, one at least that is not held out.

    Raises:
        StabilityError: If the robot has no equilibrium in a posture.
    """
    stiffness = Parameters.of(robot).stiffness
    damping = Parameters.of(with_damping_ratio(robot, _RATIO)).damping
    fitted = [not each.is_held_out for each in measured]
    instruments = np.tile([FACTOR_DEVIATION, DELAY_DEVIATION / DELAY], sum(fitted))
    prior = np.append(np.repeat([_STIFFNESS, _DAMPING], len(stiffness)), instruments)
    names, around, fit = build_chain(robot).elastic_names, robot, None
    for _ in range(_LINEARISED):
        locked, springs = LockedRobot(around, torque_curve), Parameters.of(around).stiffness
        linear = [locked.linear(each.q, np.zeros(6)) for each in measured]
        postures = tuple(
            PostureResponse.of(there, springs, each.responses)
            for there, each in zip(linear, measured, strict=True)
        )
        chosen = tuple(p for p, is_fitted in zip(postures, fitted, strict=True) if is_fitted)
        problem = ResponseProblem(chosen, stiffness, damping, prior, 1.0)
        fit = fit_responses(problem, np.full(len(prior), np.nan), fit)
        springs = fit.values[: len(stiffness)]
        values = zip(names, springs.tolist(), strict=True)
        around = apply_values(robot, {f"{name}.stiffness": k for name, k in values})
    assert fit is not None
    return replace(fit, postures=postures, unloaded=tuple(map(locked.unloaded_joints, linear)))


def fit_responses(
    problem: ResponseProblem, fixed: np.ndarray, start: ResponseFit | None = None
) -> ResponseFit:
    """Fit a robot to its frequency responses.

    Args:
        experiment: The problem.
        fixed: Values that are known, NaN for those that are fitted, units of the parameters, (P,).
        start: A fit to begin with; None: restarts over a common factor of all stiffnesses.
    """
    is_free = np.isnan(fixed)
    count = len(problem.stiffness)
    if start is None:
        starts = []
        for factor in _FACTORS:
            x = np.where(is_free, 0.0, fixed)
            x[:count] = np.where(is_free[:count], np.log(factor), x[:count])
            starts.append(replace(problem, deviation=_FIRST).at(x))
        estimated = _estimate(min(starts, key=lambda point: point.robust_cost), is_free)
    else:
        estimated = start
    for _ in range(_ROUNDS):
        size = max(_size(estimated.experiment), _LEAST)
        problem = replace(problem, deviation=size)
        x = np.where(is_free, estimated.x, fixed)
        estimated = _estimate(problem.at(x), is_free)
    point = estimated.experiment
    size = _size(point)
    noise = min(_roughness(point), size)
    deviation = _deviations(point, is_free, size, noise)
    return ResponseFit(point, estimated.converged, deviation, size, noise)


def _size(point: ResponseExperiment) -> float:
    """Return the standard deviation of what is left [1], where it is not that of valleys."""
    trust = np.concatenate([posture.trust for posture in point.problem.postures])
    residual = point.residual[trust > _PEAKS]
    size = np.median(np.abs([residual.real, residual.imag])) / _MEDIAN
    return float(size)


def _estimate(start: ResponseExperiment, is_free: np.ndarray) -> Estimate[ResponseExperiment]:
    low = np.where(is_free, -_FARTHEST, start.x)
    high = np.where(is_free, _FARTHEST, start.x)
    return estimate(start, (low, high), _MOST_STEPS, _SETTLED)


def _deviations(
    point: ResponseExperiment, is_free: np.ndarray, size: float, noise: float
) -> np.ndarray:
    """Return the standard deviations of the parameters, their units, (P,); 0 for those that are fixed.

    With the normal matrix N, the residual's deviation s and the noise n in it, d^2 = s^2 - n^2 is what
    the model does not describe.  Noise is independent from value to value; the rest is alike in all
    responses and postures, so that its K values tell no more than as many as there are P parameters:

        variance = N^-1 (n^2 + d^2 K / P) / s^2

    Args:
        point: The fit.
        is_free: Mask of the parameters that are fitted, (P,).
        size: Standard deviation s of the residual [1].
        noise: Standard deviation of the noise in it [1].
    """
    matrix, _ = point.rows
    matrix = matrix[:, is_free]
    values_each = 2 * len(point.residual) / matrix.shape[1]
    variance = max(noise, _LEAST) ** 2 + (size**2 - noise**2) * max(values_each, 1.0)
    widened = variance / point.problem.deviation**2
    deviation = np.zeros(len(is_free))
    deviation[is_free] = np.sqrt(widened * np.diag(np.linalg.pinv(matrix.T @ matrix)))
    return deviation


def _roughness(point: ResponseExperiment) -> float:
    """Return the standard deviation of noise [1], by second differences of residuals over frequencies.

    What a model does not describe is smooth, noise is not: r_(k-1) - 2 r_k + r_(k+1) has six times its
    variance.
    """
    postures, differences = point.problem.postures, []
    counts = [len(r.frequency) for posture in postures for r in posture.in_order]
    ends = np.cumsum(counts)[:-1]
    trust = np.concatenate([posture.trust for posture in postures])
    for residual, weight in zip(np.split(point.residual, ends), np.split(trust, ends), strict=True):
        second = np.diff(residual, 2)[weight[1:-1] > _PEAKS]
        differences += [second.real, second.imag]
    rough = np.concatenate(differences)
    if not len(rough):
        return np.inf
    return float(np.median(np.abs(rough))) / _MEDIAN / np.sqrt(6.0)
