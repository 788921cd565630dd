"""How sure what was learned is, by derivatives of the fit and by what it leaves over noise."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from coupling.identification.intervals import quantile
from coupling.identification.runs.fit import ParameterFit
from coupling.identification.runs.parameters import prior_of
from coupling.identification.runs.problem import FitProblem
from coupling.identification.runs.residual import noise_of


@dataclass(frozen=True)
class Uncertainty:
    """How sure log factors are.

    Attributes:
        deviation: Standard deviations of their errors [1], (P,).
        half: Half widths of their 95 % intervals [1], (P,).
        noise: Standard deviation of a measured coordinate's noise [m].
    """

    deviation: np.ndarray
    half: np.ndarray
    noise: float


def spread_of(problem: FitProblem, fit: ParameterFit) -> Uncertainty:
    """Return how sure the log factors are.

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
