"""What a fit leaves over noise, and what that means for how sure it is.

A fit whose residuals are noise is off by its covariance.  One that leaves more has either ended in a
local minimum beside the valley, or the robot does what the model does not know (model discrepancy).
What is left over noise is D in the sum of squares, each counted by the variance of its noise; P
parameters that are off by u_1 .. u_P standard deviations leave u_1^2 + .. + u_P^2 = D of it, so that u^2
is D / P in the mean.  A discrepancy moves a fit by no more if it takes twice as many independent values
along the run as there are parameters, or more.  Rows therefore count as if their variance were 1 + D /
P times that of
noise: intervals become wider, and what was known before counts more.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

# What chance leaves is no discrepancy up to so many standard deviations of it.
_CHANCE = 1.0
# Turns of the search for the number of parameters, which depends on how much rows count.
_TURNS = 6


@dataclass(frozen=True)
class UnexplainedPart:
    """What is left over noise.

    Attributes:
        over: Variance of a row as it counts, by that of noise, >= 1.
        effective: Effective number of unknowns that the rows determine, P: between none and all.
    """

    over: float
    effective: float

    @property
    def widened(self) -> float:
        """By how much intervals are wider for it."""
        return float(np.sqrt(self.over))

    @classmethod
    def of(
        cls, squares: float, rows: float, data: np.ndarray, prior: np.ndarray
    ) -> UnexplainedPart:
        """Return it for a fit.

        Args:
            squares: Sum of squares of independent rows, by the variance of their noise.
            rows: Their number.
            data: Normal matrix of the rows, each by its noise, (P, P).
            prior: Standard deviations before, (P,).

        Example:
            >>> round(UnexplainedPart.of(68.0, 50.0, 1e9 * np.eye(2), np.ones(2)).over, 6)
            6.0
        """
        over, effective, before = 1.0, 0.0, np.diag(prior**-2.0)
        for _ in range(_TURNS):
            effective = float(np.trace(np.linalg.solve(before + data / over, data / over)))
            # Noise leaves as many squares as there are rows beyond what they tell, by chance more.
            noise = rows - effective + _CHANCE * np.sqrt(2.0 * rows)
            more = max(0.0, squares - noise)
            over = 1.0 + more / max(effective, 1.0)
        return cls(float(over), effective)
