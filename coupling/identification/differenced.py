"""A residual of few parameters as a linearisation: its Jacobian by central differences."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from functools import cached_property

import numpy as np

from coupling.identification.estimate import Trial

# Step of a difference, in parts of a parameter's size or of 1.
_STEP = 1e-5


@dataclass(frozen=True)
class DifferencedResidual:
    """A residual around values of its parameters.

    Attributes:
        function: Residual [1], (n,), of the values.
        x: The values [1], scaled to sizes about 1, (P,).

    Example:
        >>> from coupling.identification.estimate import estimate
        >>> start = DifferencedResidual(lambda x: x**2 - 2.0, np.ones(1))
        >>> estimate(start, (np.zeros(1), np.full(1, 9.0)), 20, 1e-12).x.round(6)
        array([1.414214])
    """

    function: Callable[[np.ndarray], np.ndarray]
    x: np.ndarray
    is_exact = True
    unit = 1.0

    @cached_property
    def rows(self) -> tuple[np.ndarray, np.ndarray]:
        """Jacobian [1 per unit of x], (n, P), and residual [1], (n,)."""
        columns = []
        for step in np.diag(_STEP * np.maximum(np.abs(self.x), 1.0)):
            change = self.function(self.x + step) - self.function(self.x - step)
            columns.append(change / (2.0 * step.max()))
        return np.column_stack(columns), self.function(self.x)

    @cached_property
    def cost(self) -> float:
        """Half the squares of the residual [1]."""
        return 0.5 * float(np.sum(self.function(self.x) ** 2))

    def try_step(self, step: np.ndarray) -> DifferencedResidual:
        """Return the residual after a step, (P,)."""
        return DifferencedResidual(self.function, self.x + step)

    def move_to(self, trial: Trial) -> DifferencedResidual:
        """Return the residual where a trial was."""
        assert isinstance(trial, DifferencedResidual)
        return trial

    def recompute(self) -> DifferencedResidual:
        """Return this one; its derivatives are of where it is."""
        return self
