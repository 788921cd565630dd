"""The fit to loading loops: least squares on the robot's own equilibria with memory."""

from __future__ import annotations

import numpy as np
from scipy.optimize import OptimizeResult, least_squares

from coupling.errors import IdentifyError
from coupling.identification.least_squares import LinearProblem, robust_weights
from coupling.identification.loops.model import LoopModel
from coupling.identification.loops.parameters import LoopParameters
from coupling.identification.static.fit import StaticFit, whitened
from coupling.identification.static.measurements import MeasurementNoise, Measurements, whitening

# Fits, each with the weights that the one before gives, and when these have settled.
_ITERATIONS, _SETTLED = 5, 1e-3
_MOST_EVALUATIONS = 100
# Relative change of squares and parameters that ends a fit: of a thousand rows three hundredths of a
# parameter's deviation.  Closer to its kinks, where elements slip, the search would go to and fro.
_SQUARES, _STEP = 1e-6, 1e-7
# Slip angles of a gear that the file has without elements, over those at the start: larger than half of
# its wind-up in the loops they would be no hysteresis but a stiffness.
_ANGLES = (1.0 / 16.0, 4.0)


def loop_fitted(
    elasticity: LoopParameters,
    measured: Measurements,
    torque_curve: str,
    noise: MeasurementNoise,
    loss: str = "squares",
) -> StaticFit:
    """Fit a robot's parameters to loading loops; arguments as of `fitted`."""
    model, values = LoopModel(elasticity, measured, torque_curve), elasticity.start
    prediction = model.predict(values)
    weight, before = np.ones(measured.count), np.array(np.inf)

    def linearised() -> LinearProblem:
        return LinearProblem.of(*whitened(measured, prediction, values, white), elasticity.start)

    for _ in range(_ITERATIONS):
        noise = noise.estimated(measured.deflection - prediction.deflection)
        white = whitening(noise, prediction.by_wrench)
        weighted = white * weight[:, None, None]
        if np.abs(weighted - before).max() < _SETTLED * np.abs(weighted).max():
            break
        before = weighted
        values, result = settled(model, measured, weighted, values)
        prediction = model.predict(values)
        problem = linearised()
        weight = robust_weights(problem, values, loss)
    problem = linearised()
    converged, reason = result.status > 0, "converged"
    if not converged:
        reason = f"did not settle in {_MOST_EVALUATIONS} evaluations"
    return StaticFit(
        elasticity, values, prediction, problem, weight, white, converged, reason, problem
    )


def settled(
    model: LoopModel,
    measured: Measurements,
    white: np.ndarray,
    start: np.ndarray,
    hold: np.ndarray | None = None,
) -> tuple[np.ndarray, OptimizeResult]:
    """Return the values that fit best from a start on, in p's units, (P,), and the solver's result.

    Args:
        model: The model of the measurements.
        white: Their whitening matrices [1/m, 1/rad], (k, r, r).
        start: Values to begin at, in p's units, (P,); what is not identifiable stays there.
        hold: Whitened error for each parameter off its start [1 per unit of p], (P,).

    Raises:
        IdentifyError: If the robot finds no rest at the start.
    """
    own, size = model.elasticity, model.elasticity.start
    free = model.effective
    holding = (0.0 * size if hold is None else hold * size)[free]
    angles = own.chosen("slip_angle")
    low = np.where(angles, _ANGLES[0] * size, own.least)[free] / size[free]
    high = np.where(angles, _ANGLES[1], np.inf)[free]

    def valued(part: np.ndarray) -> np.ndarray:
        values = start.copy()
        values[free] = part * size[free]
        return values

    def residual(part: np.ndarray) -> np.ndarray:
        try:
            rest = model.deflection(valued(part)) - measured.deflection
        except IdentifyError:  # a trial step that is too soft
            return np.full(measured.deflection.size + len(part), np.inf)
        whitened = np.einsum("kij,kj->ki", white, rest).ravel()
        return np.append(whitened, holding * (part - begin))

    def slope(part: np.ndarray) -> np.ndarray:
        columns = white @ model.predict(valued(part)).by_parameter[:, :, free]
        columns = (columns * size[free]).reshape(measured.deflection.size, -1)
        return np.vstack([columns, np.diag(holding)])

    begin = np.clip(start[free] / size[free], low * (1.0 + 1e-9), high)
    model.deflection(valued(begin))  # raises where the search cannot begin
    result = least_squares(
        residual,
        begin,
        slope,
        (low, high),
        x_scale="jac",
        ftol=_SQUARES,
        xtol=_STEP,
        gtol=None,  # it would depend on the residual's unit
        max_nfev=_MOST_EVALUATIONS,
    )
    return valued(result.x), result
