"""Nonlinear least squares of deflections, loops and motion: damped Gauss-Newton between bounds.

    minimise  |r(x)|^2 / 2,    low <= x <= high

Weights in r that follow x, those of a robust loss or of noise that is estimated, are those of the last
step: iteratively reweighted least squares.  What is known of x before are rows of r.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Generic, Protocol, Self, TypeVar

import numpy as np
from scipy.optimize import lsq_linear

# A step that gains less than this part of the predicted gain is shortened: its damping, in parts of the
# columns' squares, where it is first needed, and the factor by which it grows.
_GAINS, _DAMPING, _GROWS = 0.1, 1e-4, 10.0
# An approximate Jacobian is computed again after a step that gains less than this part of it.
_TRUSTED = 0.5
# Predicted gain of log likelihood by an undamped step below which a fit has converged.
CONVERGED = 1e-2


class Trial(Protocol):
    """Residual of an experiment at other parameters."""

    @property
    def cost(self) -> float:
        """Half its squares, with the weights where the step began [1]."""


class Linearisation(Protocol):
    """Residual r of an experiment and its Jacobian J, around values of its parameters."""

    @property
    def x(self) -> np.ndarray:
        """Values of the parameters, any units, (P,)."""

    @property
    def rows(self) -> tuple[np.ndarray, np.ndarray]:
        """Matrix and vector, (n, P) and (n,), with the products J^T J and J^T r of all residuals.

        What is known before is in them, and what keeps directions that are not observable.
        """

    @property
    def cost(self) -> float:
        """Half the squares of r [1]."""

    @property
    def unit(self) -> float:
        """Decrease of the cost that makes the measurement likelier by e."""

    @property
    def is_exact(self) -> bool:
        """Whether J was computed at x."""

    def try_step(self, step: np.ndarray) -> Trial | None:
        """Return the residual after a step, any units, (P,); None where no model is computed."""

    def move_to(self, trial: Trial) -> Self:
        """Return the linearisation where a trial was, with weights and Jacobian of its own."""

    def recompute(self) -> Self:
        """Return this one with the Jacobian computed at x."""


Linearised = TypeVar("Linearised", bound=Linearisation)


@dataclass(frozen=True)
class Estimate(Generic[Linearised]):
    """Estimated parameters.

    Attributes:
        linearisation: The experiment around their values.
        converged: Whether another step would make what was measured hardly likelier.
        is_settled: Whether no step that is left, of any length, would: it ends so at a kink as well.
    """

    linearisation: Linearised
    converged: bool
    is_settled: bool

    @property
    def x(self) -> np.ndarray:
        """The values, any units, (P,)."""
        return self.linearisation.x

    @property
    def is_at_minimum(self) -> bool:
        """Whether it has converged or is at a kink: slopes of one side promise what no step gains."""
        return self.converged or self.is_settled


def estimate(
    start: Linearised,
    bounds: tuple[np.ndarray, np.ndarray],
    most_steps: int,
    settled: float,
) -> Estimate[Linearised]:
    """Return the parameters that explain an experiment best, from a start on.

    Args:
        start: The experiment around the start.
        bounds: Lowest and highest values, units of x, (P,) each.
        most_steps: Steps at most.
        settled: Predicted gain of log likelihood below which it ends.
    """
    point, damping = start, 0.0
    while True:
        step, gain = bounded_step(*point.rows, bounds[0] - point.x, bounds[1] - point.x, damping)
        is_settled = gain <= settled * point.unit
        if (is_settled and point.is_exact) or not most_steps:
            break
        trial = None
        if not is_settled:
            most_steps -= 1
            trial = point.try_step(step)
        gained = -np.inf if trial is None else point.cost - trial.cost
        if trial is not None and gained > _GAINS * gain:
            damping = damping / _GROWS if damping > _DAMPING else 0.0
            point = point.move_to(trial)
            if gained < _TRUSTED * gain and not point.is_exact:
                point = point.recompute()
        elif not point.is_exact:
            point = point.recompute()
        else:
            damping = max(_GROWS * damping, _DAMPING)
    if damping:
        _, gain = bounded_step(*point.rows, bounds[0] - point.x, bounds[1] - point.x)
    converged = point.is_exact and gain < CONVERGED * point.unit
    return Estimate(point, converged, is_settled and point.is_exact)


def bounded_step(
    matrix: np.ndarray,
    residual: np.ndarray,
    low: np.ndarray,
    high: np.ndarray,
    damping: float = 0.0,
) -> tuple[np.ndarray, float]:
    """Return the damped step between bounds, any units, (P,), and the predicted decrease of the cost.

    Args:
        matrix, residual: Jacobian, (n, P), and residual, (n,), any unit.
        low, high: Bounds of the step, its units, (P,) each, not above and not below zero.
        damping: Squares of the step, in parts of those of the columns.
    """
    length = np.linalg.norm(matrix, axis=0)
    scale = np.divide(1.0, length, out=np.ones_like(length), where=length > 0.0)
    damped = np.vstack([matrix * scale, np.sqrt(damping) * np.diag(length > 0.0)])
    target = np.append(-residual, np.zeros(len(low)))
    step = scale * np.linalg.lstsq(damped, target, rcond=None)[0]
    if np.any((step < low) | (step > high)):
        ends = low / scale, high / scale + 1e-12
        step = np.clip(scale * lsq_linear(damped, target, ends, method="bvls").x, low, high)
    after = residual + matrix @ step
    return step, float(0.5 * (residual @ residual - after @ after))
