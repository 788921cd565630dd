"""The fit: linear in the rigid posture, then Gauss and Newton on the robot's own equilibria."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from coupling.errors import IdentifyError
from coupling.identification.least_squares import LinearProblem, robust_weights, solved
from coupling.identification.static.elastic import ElasticParameters
from coupling.identification.static.measurements import MeasurementNoise, Measurements, whitening
from coupling.identification.static.prediction import Prediction, StaticModel, rigid_prediction

_MOST_ITERATIONS = 25
# The fit ends where an iteration moves the predictions by less than this part of the residual, or [m].
_SETTLED, _ROUNDING = 1e-5, 1e-14
# Iterations that estimate the ratio of the deviations of rotations and positions anew.
_REWEIGHTED = 4
# A step that moves them by less than this part of the residual needs no check that it fits better.
_SMALL = 1e-3
_MOST_HALVINGS = 6
# Iterations of the linear fit, whose weights follow its own compliance.
_RIGID_ITERATIONS = 2


@dataclass(frozen=True)
class StaticFit:
    """A fitted robot, and the linear problem that its last iteration has solved.

    Attributes:
        elasticity: The parameters.
        values: Fitted values of p, in its units, (P,).
        prediction: Prediction at these values.
        problem: The whitened linear problem around them, without weights of the loss.
        weight: Weights of the loss, (k,).
        white: W_i, from residuals in [m] and [rad] to whitened ones [1], (k, r, r).
        converged: Whether the last iteration moved nothing.
        reason: Outcome in words.
        rigid: The problem in the rigid posture: what postures and loads can identify at all.
    """

    elasticity: ElasticParameters
    values: np.ndarray
    prediction: Prediction
    problem: LinearProblem
    weight: np.ndarray
    white: np.ndarray
    converged: bool
    reason: str
    rigid: LinearProblem

    def in_units(self, whitened: np.ndarray) -> np.ndarray:
        """Return whitened residuals, (k, r), in [m] and [rad]."""
        return np.einsum("kij,kj->ki", np.linalg.inv(self.white), whitened)


def fitted(
    elasticity: ElasticParameters,
    measured: Measurements,
    torque_curve: str,
    noise: MeasurementNoise,
    loss: str = "squares",
) -> StaticFit:
    """Fit a robot's parameters to measurements.

    Args:
        elasticity: The parameters, with the start values.
        torque_curve: A name of `TORQUE_CURVES`.
        noise: Standard deviations.
        loss: A name of `LOSSES`.
    """
    values, rigid = _rigid_fit(elasticity, measured, noise, loss)
    model = StaticModel(elasticity, measured, torque_curve)
    prediction = rigid_prediction(elasticity, measured, values)
    problem, white = rigid, whitening(noise, prediction.by_wrench)
    converged, reason = False, f"did not settle in {_MOST_ITERATIONS} iterations"
    try:
        prediction = model.predict(values)
        for number in range(_MOST_ITERATIONS):
            if number < _REWEIGHTED:
                noise = noise.estimated(measured.deflection - prediction.deflection)
            white = whitening(noise, prediction.by_wrench)
            problem = rigid.around(*whitened(measured, prediction, values, white))
            wanted, _ = solved(problem, loss)
            step = float(np.linalg.norm(problem.columns @ (wanted - values)))
            rest = float(np.linalg.norm(problem.residual(values)))
            before = prediction
            values, prediction = _damped(
                model, problem, measured, white, values, wanted, step < _SMALL * rest
            )
            moved = float(np.abs(prediction.deflection - before.deflection).max())
            if step <= _SETTLED * rest or moved <= _ROUNDING:
                converged, reason = True, "converged"
                break
        problem = rigid.around(*whitened(measured, prediction, values, white))
    except IdentifyError as cause:
        reason = (
            f"the linear fit is too soft for the model ({cause}): are angles in rad, loads in N and"
            " deflections in m, base axes?"
        )
    weight = robust_weights(problem, values, loss)
    return StaticFit(
        elasticity, values, prediction, problem, weight, white, converged, reason, rigid
    )


def _rigid_fit(
    elasticity: ElasticParameters, measured: Measurements, noise: MeasurementNoise, loss: str
) -> tuple[np.ndarray, LinearProblem]:
    """Return the values of the fit in the rigid posture, and its problem."""
    values = elasticity.start
    for _ in range(_RIGID_ITERATIONS):
        rigid = rigid_prediction(elasticity, measured, values)
        noise = noise.estimated(measured.deflection - rigid.deflection)
        white = whitening(noise, rigid.by_wrench)
        columns = white @ rigid.by_parameter
        target = np.einsum("kij,kj->ki", white, measured.deflection)
        problem = LinearProblem.of(columns, target, elasticity.start)
        values, _ = solved(problem, loss)
    return values, problem


def whitened(
    measured: Measurements, prediction: Prediction, values: np.ndarray, white: np.ndarray
) -> tuple[np.ndarray, np.ndarray]:
    """Return whitened columns [1 per unit of p], (k, r, P), and targets [1], (k, r), around values.

    Args:
        prediction: Prediction at the values.
        values: Values of p, in its units, (P,), around which the model is linearised.
        white: Matrices that whiten the rows [1/m, 1/rad], (k, r, r).
    """
    rest = measured.deflection - prediction.deflection + prediction.by_parameter @ values
    return white @ prediction.by_parameter, np.einsum("kij,kj->ki", white, rest)


def _damped(
    model: StaticModel,
    problem: LinearProblem,
    measured: Measurements,
    white: np.ndarray,
    values: np.ndarray,
    wanted: np.ndarray,
    at_once: bool,
) -> tuple[np.ndarray, Prediction]:
    """Return the farthest values on the way to those wanted that fit better, or all of it at once."""

    def cost(prediction: Prediction) -> float:
        rest = measured.deflection - prediction.deflection
        return float(np.sum(np.einsum("kij,kj->ki", white, rest) ** 2))

    start = float(np.sum(problem.residual(values) ** 2))
    part = 1.0
    for _ in range(_MOST_HALVINGS):
        after = model.predict(values + part * (wanted - values))
        if at_once or cost(after) <= start * (1.0 + 1e-9):
            break
        part *= 0.5
    return values + part * (wanted - values), after
