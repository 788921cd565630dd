"""The fit to deflections at rest: from the best one in the rigid posture to the model's equilibria."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np

from coupling.errors import IdentifyError
from coupling.identification.estimate import Estimate, estimate
from coupling.identification.evidence import support
from coupling.identification.intervals import ConfidenceIntervals, intervals
from coupling.identification.least_squares import LinearProblem, robust_weights
from coupling.identification.separability import Separability, separability
from coupling.identification.static.elastic import ElasticParameters
from coupling.identification.static.measurements import MeasurementNoise, Measurements, whitening
from coupling.identification.static.model import StaticModel
from coupling.identification.static.prediction import Prediction, rigid_prediction
from coupling.results.parameter_result import EvidenceResult

_MOST_STEPS = 100
# Predicted gain of log likelihood below which a fit ends: a millionth of a deviation; and, of loops, a
# few thousandths: closer to its kinks, where elements slip, the search would go to and fro.
_SETTLED, _LOOPS_SETTLED = 1e-12, 1e-5
# Slip angles of a gear that the file has without elements, over those at the start: larger than half of
# its wind-up in the loops they would be no hysteresis but a stiffness.
_ANGLES = (1.0 / 16.0, 4.0)
# Errors below this are rounding of the equilibria [m].
_ROUNDING = 1e-11


@dataclass(frozen=True)
class IdentifyOptions:
    """How to identify.

    Attributes:
        torque_curve: A name of `TORQUE_CURVES`.
        noise: Standard deviations.
        loss: A name of `LOSSES`.
        add: Names of candidates to add to the robot, or "supported" for all that are supported.
    """

    noise: MeasurementNoise
    torque_curve: str = "backlash"
    loss: str = "squares"
    add: tuple[str, ...] = ()


@dataclass(frozen=True)
class StaticProblem:
    """Deflections at rest, and what predicts them, before a fit.

    Attributes:
        elasticity: The parameters, whose start is kept where nothing is observable.
        measured: The measurements.
        predict: Function of values of p, in its units, (P,).
        noise: Standard deviations.
        loss: A name of `LOSSES`.
        observable: Problem whose directions that are not observable are held; None: those of each step.
        white: Matrices that whiten the rows, weights in them [1/m, 1/rad], (k, r, r), that stay; None:
            those of noise and loss.
        prior: Whitened error for each parameter off `prior_mean` [1 per unit of p], (P,); None for none.
        prior_mean: Values of p that are known before, in its units, (P,).
    """

    elasticity: ElasticParameters
    measured: Measurements
    predict: Callable[[np.ndarray], Prediction]
    noise: MeasurementNoise
    loss: str = "squares"
    observable: LinearProblem | None = None
    white: np.ndarray | None = None
    prior: np.ndarray | None = None
    prior_mean: np.ndarray | None = None

    def known_before(self, values: np.ndarray) -> np.ndarray:
        """Return whitened errors of values of p, in its units, (P,), by what is known before [1]."""
        if self.prior is None or self.prior_mean is None:
            return np.zeros(0)
        return self.prior * (values - self.prior_mean)

    def linearise(self, values: np.ndarray) -> StaticExperiment:
        """Return the experiment around values of p, in its units, (P,).

        Raises:
            IdentifyError: If the robot finds no rest there, with the row.
        """
        prediction = self.predict(values)
        residual = self.measured.deflection - prediction.deflection
        white = self.white
        if white is None:
            white = whitening(self.noise.estimated(residual), prediction.by_wrench)
        columns = white @ prediction.by_parameter
        target = np.einsum("kij,kj->ki", white, residual + prediction.by_parameter @ values)
        if self.observable is None:
            linear = LinearProblem.of(columns, target, self.elasticity.start)
        else:
            linear = self.observable.around(columns, target)
        weight = np.ones(self.measured.count)
        if self.white is None:
            weight = robust_weights(linear, values, self.loss)
        return StaticExperiment(self, values, prediction, white, linear, weight)


@dataclass(frozen=True)
class StaticExperiment:
    """Deflections at rest around values of the parameters.

    Attributes:
        problem: The problem.
        x: Values of p, in its units, (P,).
        prediction: Prediction there.
        white: W_i, from residuals in [m] and [rad] to whitened ones [1], (k, r, r).
        linear: The whitened linear problem, without weights of the loss.
        weight: These weights, (k,).
    """

    problem: StaticProblem
    x: np.ndarray
    prediction: Prediction
    white: np.ndarray
    linear: LinearProblem
    weight: np.ndarray
    is_exact = True

    @property
    def rows(self) -> tuple[np.ndarray, np.ndarray]:
        """Weighted columns and residual, what is not observable held, and what is known before."""
        weighted, linear = self.linear.weighted(self.weight), self.linear
        away = self.x - linear.start
        holding = np.divide(
            linear.unseen,
            linear.scale,
            out=np.zeros_like(linear.unseen),
            where=linear.scale > 0.0,
        )
        columns = np.where(linear.scale > 0.0, weighted.columns, 0.0)
        matrix = [columns.reshape(-1, len(away)), holding]
        residual = [-weighted.residual(self.x).ravel(), holding @ away]
        if self.problem.prior is not None:
            matrix.append(np.diag(self.problem.prior))
            residual.append(self.problem.known_before(self.x))
        return np.vstack(matrix), np.concatenate(residual)

    @property
    def unit(self) -> float:
        """Variance of a number as it is left, and at least that of rounding [1]."""
        count = self.linear.target.size
        return max(2.0 * self.cost(self), _ROUNDING**2 * float(np.sum(self.white**2))) / count

    def cost(self, weighted: StaticExperiment) -> float:
        """Return half the squares of the residual [1], with the weights around other values."""
        residual = self.problem.measured.deflection - self.prediction.deflection
        whitened = np.einsum("kij,kj->ki", weighted.white, residual) * weighted.weight[:, None]
        prior = self.problem.known_before(self.x)
        return 0.5 * float(np.sum(whitened**2) + prior @ prior)

    def at(self, x: np.ndarray) -> StaticExperiment | None:
        """Return the experiment around other values, (P,); None where the robot finds no rest."""
        try:
            return self.problem.linearise(x)
        except IdentifyError:
            return None

    def recompute(self) -> StaticExperiment:
        """Return the same: its Jacobian is exact."""
        return self

    def in_units(self, whitened: np.ndarray) -> np.ndarray:
        """Return whitened residuals, (k, r), in [m] and [rad]."""
        return np.einsum("kij,kj->ki", np.linalg.inv(self.white), whitened)


@dataclass(frozen=True)
class StaticFit(Estimate[StaticExperiment]):
    """A fitted robot.

    Attributes:
        model: The robot's equilibria.
        reason: Outcome in words.
        rigid: The problem in the rigid posture: what postures and loads can identify at all.
    """

    model: StaticModel
    reason: str
    rigid: LinearProblem

    @property
    def elasticity(self) -> ElasticParameters:
        """The parameters."""
        return self.model.elasticity

    @cached_property
    def intervals(self) -> ConfidenceIntervals:
        """95 % intervals of the parameters."""
        at = self.experiment
        return intervals(at.linear, at.weight, at.x, at.problem.noise.is_known)

    @cached_property
    def separability(self) -> Separability:
        """Separability of the parameters by postures and loads."""
        return separability(self.rigid, self.elasticity.names)

    @cached_property
    def supports(self) -> dict[int, EvidenceResult]:
        """Tests of tilts, backlash and hysteresis, by their number."""
        elasticity, at = self.elasticity, self.experiment
        tested = np.flatnonzero(~elasticity.is_torsion & ~elasticity.chosen("slip_angle")).tolist()
        return {
            j: support(at.linear, elasticity.together(j), at.weight, len(tested)) for j in tested
        }


def fit_static(
    elasticity: ElasticParameters, measured: Measurements, options: IdentifyOptions
) -> StaticFit:
    """Fit a robot's parameters, from their start on, to deflections from rest or along loops."""
    model = StaticModel(elasticity, measured, options.torque_curve)
    problem = StaticProblem(elasticity, measured, model.predict, options.noise, options.loss)
    start, first = elasticity.start, None
    if measured.loop is None:

        def predict_rigid(values: np.ndarray) -> Prediction:
            return rigid_prediction(elasticity, measured, values)

        first = fit_from(replace(problem, predict=predict_rigid), start).experiment
        start, problem = first.x, replace(problem, observable=first.linear)
    try:
        estimated = fit_from(problem, start)
    except IdentifyError as cause:
        if first is None:
            raise
        reason = (
            f"the linear fit is too soft for the model ({cause}): are angles in rad, loads in N and"
            " deflections in m, base axes?"
        )
        return StaticFit(first, False, model, reason, first.linear)
    converged = estimated.converged
    reason = "converged" if converged else f"did not settle in {_MOST_STEPS} steps"
    rigid = problem.observable or estimated.experiment.linear
    return StaticFit(estimated.experiment, converged, model, reason, rigid)


def fit_from(problem: StaticProblem, start: np.ndarray) -> Estimate[StaticExperiment]:
    """Return the values that fit a problem best, from a start on, in p's units, (P,).

    Raises:
        IdentifyError: If the robot finds no rest at the start.
    """
    elasticity, has_loops = problem.elasticity, problem.measured.loop is not None
    size, angles = elasticity.start, elasticity.chosen("slip_angle")
    low = np.where(angles, _ANGLES[0] * size, elasticity.least if has_loops else 0.0)
    high = np.where(angles, _ANGLES[1] * size, np.inf)
    settled = _LOOPS_SETTLED if has_loops else _SETTLED
    return estimate(problem.linearise(np.clip(start, low, high)), (low, high), _MOST_STEPS, settled)
