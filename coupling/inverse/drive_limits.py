"""Limits of a drive, and whether a command keeps to them between its rows as well."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import dataclass
from math import ceil
from typing import TypeVar

import numpy as np
from scipy import sparse

from coupling.errors import PlanningError
from coupling.inverse.rows import CommandRows, stretches
from coupling.inverse.spline import UniformSpline

# A link that its drive's limits keep so far from its motion does not follow the path at all [rad].
_LOST = 1e-3

# What a command keeps back of a limit, so that rounding does not pass it.
_HAIR = 1e-7

# A stretch begins and ends so long before and after the limits bind [s]; doubled where no command
# within the limits joins the one outside.
_MARGIN = 0.2

_QUANTITIES = ("angle", "rate", "acceleration")
_UNITS = ("rad", "rad/s", "rad/s^2")

Unknowns = TypeVar("Unknowns")


class NoCommandError(Exception):
    """No command within the limits leads from one end to the other."""


@dataclass(frozen=True)
class DriveLimits:
    """Limits of a drive, at all times; infinite where none is known.

    Attributes:
        joint: Number of the joint, from 1.
        lower: Lowest angle [rad].
        upper: Highest angle [rad].
        rate: Largest |q'| [rad/s].
        acceleration: Largest |q''| [rad/s^2].

    Example:
        >>> bend = UniformSpline(0.0, 0.1, np.array([[0.0], [1.0], [2.0], [4.0]]), degree=3)
        >>> bend.at(np.array([0.1]), order=2).round(6).item()
        100.0
        >>> DriveLimits(2, acceleration=5.0).excess(bend).tolist()  # times 0.1 s squared
        [0.0, 0.95, 0.0, 0.0]
    """

    joint: int
    lower: float = -np.inf
    upper: float = np.inf
    rate: float = np.inf
    acceleration: float = np.inf

    def excess(self, command: UniformSpline) -> np.ndarray:
        """Return by how much a command passes its limits, from each coefficient on [rad], (n,)."""
        worst = np.zeros(len(command.coefficients))
        for rows, low, high in self._each(len(worst), command.degree, command.spacing):
            points = rows @ command.coefficients[:, 0]
            beyond = np.maximum(points - high, low - points)
            np.maximum.at(worst, rows.indices[rows.indptr[:-1]], beyond)
        return worst

    def keep(
        self,
        best: Unknowns,
        command_of: Callable[[Unknowns], UniformSpline],
        solve: Callable[[Unknowns, int, int], Unknowns | None],
    ) -> Unknowns:
        """Return the best unknowns within the limits: they change on stretches where these bind.

        Args:
            best: The best unknowns without limits.
            command_of: Function that gives the command of unknowns.
            solve: Function that gives the best ones where only those between two intervals may change;
                None where no command there keeps to the limits.

        Raises:
            NoCommandError: If none does.
        """
        command, unknowns, is_whole = command_of(best), best, False
        degree, count = command.degree, len(command.coefficients) - command.degree
        margin = max(ceil(_MARGIN / command.spacing), 4 * degree)
        while (over := self.excess(command_of(unknowns)) > 0.0).any():
            if is_whole:
                raise NoCommandError
            is_whole = margin >= count
            for begin, end in stretches(over, margin, count, degree).tolist():
                solved = solve(unknowns, begin, end)
                unknowns = unknowns if solved is None else solved
            margin *= 2
        return unknowns

    def rows(self, command: UniformSpline) -> tuple[sparse.csr_array, np.ndarray, np.ndarray]:
        """Return D, low, high of the limits of a change c (n,):  low <= D c <= high [rad], (rows,)."""
        size = len(command.coefficients)
        each = list(self._each(size, command.degree, command.spacing))
        rows = sparse.vstack(
            [sparse.csr_array((0, size)), *(rows for rows, _, _ in each)], format="csr"
        )
        # Of the span of a difference, for an angle has no size of its own.
        hair = _HAIR * command.spacing**2
        count = [rows.shape[0] for rows, _, _ in each]
        low = np.repeat([low + min(hair, _HAIR * abs(low)) for _, low, _ in each], count)
        high = np.repeat([high - min(hair, _HAIR * abs(high)) for _, _, high in each], count)
        now = rows @ command.coefficients[:, 0]
        return rows, low - now, high - now

    def _each(
        self, size: int, degree: int, cycle: float
    ) -> Iterator[tuple[sparse.csr_array, float, float]]:
        """Yield control points of angle, rate and acceleration as rows, and their bounds [rad].

        A derivative of order m lies between its control points, here times the cycle to the power m.
        For angle and rate those are its coefficients; the acceleration of a quintic would be
        held to a third of its limit by them where it alternates: it has Bezier's, interval by interval.
        """
        bounds = ((self.lower, self.upper), (-self.rate, self.rate))
        for order, (low, high) in enumerate((*bounds, (-self.acceleration, self.acceleration))):
            if np.isinf(low) and np.isinf(high):
                continue
            rows = _differences(size, order)
            if order == 2 and degree == 5:
                rows = sparse.csr_array(_bezier(size - 2) @ rows)
            yield rows, low * cycle**order, high * cycle**order

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

    def require_followed(self, link: UniformSpline, rows: CommandRows, misses: np.ndarray) -> None:
        """Refuse a path whose link is lost: its drive's limits keep it from following.

        Limits that cost accuracy alone are none of this.

        Args:
            link: Motion of the link, one column.
            misses: By how much it is missed at even times [rad], (nodes,).

        Raises:
            PlanningError: With what the path asks for.
        """
        if np.abs(misses).max() > _LOST:
            raise self.lost(link, rows)

    def lost(self, link: UniformSpline, rows: CommandRows) -> PlanningError:
        """Return the error that says which limit a link's own motion passes most, and when."""
        times = np.linspace(rows.start, rows.end, 4 * rows.count + 1)
        worst, text = -np.inf, ""
        for order, most in ((1, self.rate), (2, self.acceleration)):
            needed = np.abs(link.at(times, order)[:, 0])
            k = int(needed.argmax())
            if np.isfinite(most) and needed[k] / most > worst:
                worst = float(needed[k] / most)
                text = (
                    f"expected at most {most:.6g} {_UNITS[order]} of {_QUANTITIES[order]}, got a path"
                    f" that needs {needed[k]:.6g} {_UNITS[order]} at {times[k]:.3f} s"
                )
        text = text or f"no command from {self.lower:.6g} to {self.upper:.6g} rad joins its ends"
        return PlanningError(f"joint {self.joint}: {text}: slow down the path")


def _differences(size: int, order: int) -> sparse.csr_array:
    """Return the differences of an order of coefficients."""
    weights = ([1.0], [-1.0, 1.0], [1.0, -2.0, 1.0])[order]
    shape = (size - order, size)
    return sparse.diags_array(weights, offsets=range(order + 1), shape=shape, format="csr")


def _bezier(size: int) -> sparse.csr_array:
    """Return Bezier's control points of the pieces of a uniform cubic B-spline, ends once."""
    ends = sparse.diags_array([1 / 6, 4 / 6, 1 / 6], offsets=range(3), shape=(size - 2, size))
    inner = [
        sparse.diags_array(pair, offsets=(1, 2), shape=(size - 3, size))
        for pair in ([2 / 3, 1 / 3], [1 / 3, 2 / 3])
    ]
    return sparse.vstack([ends, *inner], format="csr")
