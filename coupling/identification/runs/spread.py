"""How sure what was learned is: what the fit says of itself, or the same fit of robots that are known.

A fit says so by its residuals and derivatives, with the discrepancy beyond noise in both
(`UnexplainedPart`).  Or, for any robot and path, robots are drawn around the one found, as far from it
as the fit says of itself, measured in simulation with the noise of the measurement, and learned from
the start again; by how much they are missed is the interval.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace

import numpy as np
from scipy.spatial.transform import Rotation

from coupling.identification.runs.fit import Fitter, ParameterFit
from coupling.identification.runs.parameters import prior_of
from coupling.identification.runs.problem import FitProblem
from coupling.identification.runs.residual import Residual, noise_of
from coupling.identification.verdict import quantile


@dataclass(frozen=True)
class Uncertainty:
    """How sure log factors are.

    Attributes:
        deviation: Standard deviations of their errors [1], (P,).
        half: Half widths of their 95 % intervals [1], (P,).
        noise: Standard deviation of a measured coordinate's noise [m].
        draws: Number of simulated robots; 0 where it is the fit's own.
    """

    deviation: np.ndarray
    half: np.ndarray
    noise: float
    draws: int = 0


def spread_of_fit(problem: FitProblem, fit: ParameterFit) -> Uncertainty:
    """Return what the fit says of itself.

    Args:
        problem: Problem that was fitted.
        fit: Result of the fit.
    """
    count = len(problem.parameters)
    deviation = np.sqrt(np.diag(fit.covariance)[:count])
    deviation = np.minimum(deviation, prior_of(problem.parameters))
    return Uncertainty(
        deviation,
        # What is left has a scale of as many independent values as there are identifiable parameters.
        quantile(max(fit.left_over.effective, 1.0)) * deviation,
        noise_of([rows[:, :3] for rows in fit.residuals]),
    )


def spread_of(
    problem: FitProblem,
    fit: ParameterFit,
    start: np.ndarray,
    draws: int,
    seed: int,
    progress: Callable[[int, int], None] = lambda count, total: None,
) -> Uncertainty:
    """Return how far robots like the one found are missed by the same fit.

    Args:
        problem: Problem that was fitted.
        fit: Result of the fit.
        start: Log factors at which it began [1], (P,).
        draws: Number of robots.
        seed: Seed of their parameters and noise.
        progress: Function called with the number of those done.
    """
    rng, count = np.random.default_rng(seed), len(problem.parameters)
    noise = noise_of([rows[:, :3] for rows in fit.residuals])
    covariance = fit.covariance[:count, :count]
    robots = rng.multivariate_normal(fit.z[:count], 0.5 * (covariance + covariance.T), draws)
    errors = []
    for number, x in enumerate(robots):
        runs = []
        for run in problem.runs:
            path = run.simulated(problem.fmu, problem.robot_at(x))
            position = path.position(run.measured.time)
            position = position + noise * rng.standard_normal(position.shape)
            rotation = None
            if run.tool_rotation is not None:
                turns = Residual(run).noise[1] * rng.standard_normal(position.shape)
                rotation = Rotation.from_rotvec(turns) * path.rotation(run.measured.time)
            motors = run.measured.motors
            if motors is not None:
                values = path.motors(run.measured.time)
                values = values + motors.deviation * rng.standard_normal(values.shape)
                motors = replace(motors, values=values)
            measured = replace(run.measured, position=position, rotation=rotation, motors=motors)
            runs.append(replace(run, measured=measured))
        fit_of_sample = Fitter(replace(problem, runs=tuple(runs))).fit(start)
        errors.append(fit_of_sample.z[:count] - x)
        progress(number + 1, draws)
    # A few draws may miss what nothing tells by luck: not less than the fit says of itself.
    deviation = np.sqrt(np.diag(covariance))
    deviation = np.maximum(np.sqrt(np.mean(np.array(errors) ** 2, axis=0)), deviation)
    return Uncertainty(deviation, quantile(draws) * deviation, noise, draws)
