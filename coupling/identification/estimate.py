"""Nonlinear least squares of every experiment: damped Gauss-Newton between bounds.

    minimise  |r(x)|^2 / 2,    low <= x <= high

Weights in r that follow x, those of a robust loss or of noise that is estimated, are those of the last
step: iteratively reweighted least squares.  What is known of x before are rows of r.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Generic, Protocol, Self, TypeVar

import numpy as np

from coupling.identification.least_squares import bounded_step

# A step that gains less than this part of the predicted gain is shortened: its damping, in parts of the
# columns' squares, where it is first needed, and the factor by which it grows.
_GAINS, _DAMPING, _GROWS = 0.1, 1e-4, 10.0
# An approximate Jacobian is computed again after a step that gains less than this part of it.
_TRUSTED = 0.5
# Predicted gain of log likelihood by an undamped step below which a fit has converged.
CONVERGED = 1e-2


class Experiment(Protocol):
    """A measurement and what a model leaves of it, around values of its parameters."""

    @property
    def x(self) -> np.ndarray:
        """Values of the parameters, any units, (P,)."""

    @property
    def rows(self) -> tuple[np.ndarray, np.ndarray]:
        """Matrix and vector, (n, P) and (n,), with the products J^T J and J^T r of all residuals.

        What is known before is in them, and what keeps directions that are not observable.
        """

    @property
    def unit(self) -> float:
        """Decrease of the cost that makes the measurement likelier by e."""

    @property
    def is_exact(self) -> bool:
        """Whether J was computed at x."""

    def cost(self, weighted: Self) -> float:
        """Return half the squares of r [1], with the weights of the experiment around other values."""

    def at(self, x: np.ndarray) -> Self | None:
        """Return the same around other values, (P,), with weights of its own; None without a model."""

    def recompute(self) -> Self:
        """Return this one with J computed at x."""


Fitted = TypeVar("Fitted", bound=Experiment)


@dataclass(frozen=True)
class Estimate(Generic[Fitted]):
    """Estimated parameters; fits say more of them.

    Attributes:
        experiment: The experiment around their values.
        converged: Whether another step would make what was measured hardly likelier; at a kink, where
            slopes of one side promise what none gains, one of a length that was not tried.
    """

    experiment: Fitted
    converged: bool

    @property
    def x(self) -> np.ndarray:
        """The values, any units, (P,)."""
        return self.experiment.x


def estimate(
    start: Fitted,
    bounds: tuple[np.ndarray, np.ndarray],
    most_steps: int,
    settled: float,
) -> Estimate[Fitted]:
    """Return the parameters that explain an experiment best, from a start on.

    Args:
        start: The experiment around the start.
        bounds: Lowest and highest values, units of x, (P,) each.
        most_steps: Steps at most.
        settled: Predicted gain of log likelihood below which it ends.
    """
    point, damping, is_rejected = start, 0.0, False
    while True:
        step, gain = bounded_step(*point.rows, bounds[0] - point.x, bounds[1] - point.x, damping)
        is_settled = gain <= settled * point.unit
        if (is_settled and point.is_exact) or not most_steps:
            break
        trial = None
        if not is_settled:
            most_steps -= 1
            trial = point.at(point.x + step)
        gained = -np.inf if trial is None else point.cost(point) - trial.cost(point)
        if trial is not None and gained > _GAINS * gain:
            damping, is_rejected = damping / _GROWS if damping > _DAMPING else 0.0, False
            is_trusted = trial.is_exact or gained >= _TRUSTED * gain
            point = trial if is_trusted else trial.recompute()
        elif not point.is_exact:
            point = point.recompute()
        else:
            damping, is_rejected = max(_GROWS * damping, _DAMPING), True
    if damping and not (is_settled and is_rejected):
        _, gain = bounded_step(*point.rows, bounds[0] - point.x, bounds[1] - point.x)
    converged = point.is_exact and gain <= max(settled, CONVERGED) * point.unit
    return Estimate(point, converged)
