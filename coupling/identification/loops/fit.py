"""The fit to loading loops: the robot's equilibria with memory in the place of those from rest."""

from __future__ import annotations

import numpy as np

from coupling.identification.estimate import Estimate
from coupling.identification.loops.model import LoopModel
from coupling.identification.loops.parameters import LoopParameters
from coupling.identification.static.fit import (
    StaticExperiment,
    StaticFit,
    StaticLinearisation,
    fit_from,
)
from coupling.identification.static.measurements import MeasurementNoise, Measurements

# Predicted gain of log likelihood below which a fit ends, a few thousandths of a deviation:
# closer to its kinks, where elements slip, the search would go to and fro.
_SETTLED = 1e-5
# Slip angles of a gear that the file has without elements, over those at the start: larger than half of
# its wind-up in the loops they would be no hysteresis but a stiffness.
_ANGLES = (1.0 / 16.0, 4.0)


def fit_loops(
    elasticity: LoopParameters,
    measured: Measurements,
    torque_curve: str,
    noise: MeasurementNoise,
    loss: str = "squares",
) -> StaticFit:
    """Fit a robot's parameters to loading loops; arguments as of `fit_static`."""
    model = LoopModel(elasticity, measured, torque_curve)
    experiment = StaticExperiment(elasticity, measured, model.predict, noise, loss)
    return StaticFit.of(fit_loops_from(experiment, elasticity.start))


def fit_loops_from(
    experiment: StaticExperiment, start: np.ndarray
) -> Estimate[StaticLinearisation]:
    """Return the values that fit loops best, from a start on, in p's units, (P,).

    Raises:
        IdentifyError: If the robot finds no rest at the start.
    """
    elasticity = experiment.elasticity
    assert isinstance(elasticity, LoopParameters)
    size, angles = elasticity.start, elasticity.chosen("slip_angle")
    low = np.where(angles, _ANGLES[0] * size, elasticity.least)
    high = np.where(angles, _ANGLES[1] * size, np.inf)
    return fit_from(experiment, np.clip(start, low, high), (low, high), _SETTLED)
