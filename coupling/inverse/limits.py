"""What a drive can do, and whether a command keeps to it between its rows as well."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy import sparse

from coupling.errors import PlanningError
from coupling.inverse.rows import Rows
from coupling.inverse.spline import UniformSpline

# A link that its drive's limits keep so far from its motion does not follow the path at all [rad].
_LOST = 1e-3

# What a command keeps back of a limit, so that rounding does not pass it.
_HAIR = 1e-7

_QUANTITIES = ("angle", "rate", "acceleration")
_UNITS = ("rad", "rad/s", "rad/s^2")


@dataclass(frozen=True)
class DriveLimits:
    """What a drive can do, at all times; infinite where nothing is known.

    Attributes:
        joint: Number of the joint, from 1.
        lower: Lowest angle [rad].
        upper: Highest angle [rad].
        rate: Largest |q'| [rad/s].
        acceleration: Largest |q''| [rad/s^2].

    Example:
        >>> limits = DriveLimits(2, acceleration=5.0)
        >>> limits.excess(np.array([0.0, 1.0, 2.0, 4.0]), cycle=1.0).tolist()
        [0.0, 0.0, 0.0, 0.0]
        >>> limits.excess(np.array([0.0, 1.0, 2.0, 4.0]), cycle=0.1).tolist()  # 100 rad/s^2
        [0.0, 0.95, 0.0, 0.0]
    """

    joint: int
    lower: float = -np.inf
    upper: float = np.inf
    rate: float = np.inf
    acceleration: float = np.inf

    def bounds(self, order: int, cycle: float) -> tuple[float, float]:
        """Return what the differences of that order of a command's coefficients may be [rad].

        They are the control points of its derivative, times the cycle to that power: the derivative
        lies between the least and the largest of those nearby, at all times.
        """
        if order == 0:
            return self.lower, self.upper
        most = (self.rate, self.acceleration)[order - 1] * cycle**order
        return -most, most

    def excess(self, coefficients: np.ndarray, cycle: float) -> np.ndarray:
        """Return the most by which differences from each coefficient on pass their bounds [rad]."""
        worst = np.zeros(len(coefficients))
        for order in range(3):
            low, high = self.bounds(order, cycle)
            values = np.diff(coefficients, order)
            beyond = np.maximum(values - high, low - values)
            worst[: len(values)] = np.maximum(worst[: len(values)], beyond)
        return worst

    def rows(
        self, coefficients: np.ndarray, cycle: float
    ) -> tuple[sparse.csr_array, np.ndarray, np.ndarray]:
        """Return D and what a change c of the coefficients has to keep:  low <= D c <= high [rad]."""
        count = len(coefficients)
        blocks, lows, highs = [], [], []
        for order in range(3):
            low, high = self.bounds(order, cycle)
            if np.isinf(low) and np.isinf(high):
                continue
            binomial = [np.ones(1), np.array([-1.0, 1.0]), np.array([1.0, -2.0, 1.0])][order]
            offsets = list(range(order + 1))
            shape = (count - order, count)
            blocks.append(sparse.diags_array(binomial, offsets=offsets, shape=shape, format="csr"))
            now = np.diff(coefficients, order)
            hair = _HAIR * cycle**2 if order == 0 else _HAIR * high
            lows.append(low + hair - now)
            highs.append(high - hair - now)
        return sparse.vstack(blocks, format="csr"), np.concatenate(lows), np.concatenate(highs)

    def require_reach(self, times: np.ndarray, angles: np.ndarray) -> None:
        """Refuse angles that the path needs (k,) at times (k,) [s] and the drive does not reach.

        Raises:
            PlanningError: With the first of them.
        """
        outside = np.flatnonzero((angles < self.lower) | (angles > self.upper))
        if len(outside):
            k = int(outside[0])
            raise PlanningError(
                f"joint {self.joint}: expected an angle of {self.lower:.6g} to {self.upper:.6g} rad,"
                f" got {angles[k]:.6g} rad at {times[k]:.3f} s: place the part elsewhere"
            )

    def require_followed(self, link: UniformSpline, rows: Rows, misses: np.ndarray) -> None:
        """Refuse a path whose link is lost: its drive's limits keep it from following.

        Limits that cost accuracy alone are none of this.

        Args:
            link: Motion of the link, one column.
            rows: Those of the command.
            misses: By how much it is missed at even times [rad].

        Raises:
            PlanningError: With what the path asks for.
        """
        if np.abs(misses).max() > _LOST:
            raise self.lost(link, rows)

    def lost(self, link: UniformSpline, rows: Rows) -> PlanningError:
        """Return the error that says which limit a link's own motion passes most, and when."""
        times = np.linspace(rows.start, rows.end, 4 * rows.count + 1)
        worst, text = -np.inf, ""
        for order, most in ((1, self.rate), (2, self.acceleration)):
            asked = np.abs(link.at(times, order)[:, 0])
            k = int(asked.argmax())
            if np.isfinite(most) and asked[k] / most > worst:
                worst = float(asked[k] / most)
                text = (
                    f"expected at most {most:.6g} {_UNITS[order]} of {_QUANTITIES[order]}, got a path"
                    f" that asks for {asked[k]:.6g} {_UNITS[order]} at {times[k]:.3f} s"
                )
        text = text or f"no command from {self.lower:.6g} to {self.upper:.6g} rad joins its ends"
        return PlanningError(f"joint {self.joint}: {text}: slow down the path")
