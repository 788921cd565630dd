"""The controller's rows: where a command's unknowns stand, and in which order."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from math import ceil

import numpy as np

# Longest interval over which the torque errors of a link may cancel [s], however long the cycle: with
# twice that, an 8 ms command leaves the robot several times the deviation.
_LONGEST_STEP = 0.002


@dataclass(frozen=True)
class CommandRows:
    """The rows of a command: even times, and how the controller moves between them.

    Attributes:
        start: Time of the first row [s].
        cycle: Distance of the rows [s], > 0.
        count: Number of intervals between rows; the rows are one more.
        degree: 5 for rows of angle, rate and acceleration (quintic, C4 as we choose them), 3 for
            rows of angles alone, between which the controller lays a C2 cubic spline that is at
            rest (zero rate) at both ends.
        rest: Whether the path is at rest at its start, and at its end.

    Raises:
        ValueError: If the degree is neither 3 nor 5, or there are fewer intervals than that.
    """

    start: float
    cycle: float
    count: int
    degree: int
    rest: tuple[bool, bool] = (True, True)

    def __post_init__(self) -> None:
        if self.degree not in (3, 5):
            raise ValueError(f"expected rows of degree 3 or 5, got {self.degree}")
        if self.count < self.degree:
            raise ValueError(
                f"expected at least {self.degree} intervals between rows, got {self.count}: take a"
                " shorter cycle"
            )

    @property
    def end(self) -> float:
        """Time of the last row [s]."""
        return self.start + self.cycle * self.count

    @property
    def coefficients(self) -> int:
        """Number of the command's B-spline coefficients."""
        return self.count + self.degree

    def still(self, side: int) -> list[int]:
        """Return the orders of the derivatives that are zero at the start (0) or end (1)."""
        if self.degree == 3:
            return [1]
        return [1, 2] if self.rest[side] else []


@dataclass(frozen=True)
class Layout:
    """Order of the unknowns: the command's coefficients, and between them the link's misses.

    The miss delta [rad] is the angle by which the link is ahead of the wanted one; it is unknown at
    `parts` + 1 nodes an interval of the rows.  Group g holds coefficient g - 1 and `parts` misses
    near its middle, so that all that meets in interval i stands in groups i to i + degree + 1, its
    block: the normal equations are a band.

    Attributes:
        count: Intervals between rows.
        degree: Degree of the command.
        parts: Steps an interval.
    """

    count: int
    degree: int
    parts: int

    @classmethod
    def of(cls, rows: CommandRows) -> Layout:
        """Return the layout of rows, in even steps of 2 ms at most."""
        return cls(rows.count, rows.degree, max(1, ceil(rows.cycle / _LONGEST_STEP - 1e-9)))

    @property
    def nodes(self) -> int:
        """Number of nodes, both ends included."""
        return self.count * self.parts + 1

    @property
    def stride(self) -> int:
        """Unknowns of a group."""
        return self.parts + 1

    @property
    def width(self) -> int:
        """Unknowns of a block."""
        return (self.degree + 2) * self.stride

    @property
    def size(self) -> int:
        """Number of all unknowns, of which a few at the ends have no meaning."""
        return (self.count + self.degree + 1) * self.stride

    @cached_property
    def coefficient(self) -> np.ndarray:
        """Index of each coefficient, (count + degree,)."""
        return self.stride * (1 + np.arange(self.count + self.degree))

    @cached_property
    def miss(self) -> np.ndarray:
        """Index of each miss, (nodes,)."""
        return self._place(np.arange(self.nodes))

    @cached_property
    def block_coefficient(self) -> np.ndarray:
        """Index in the block of interval i of coefficients i - 1 to i + degree, (degree + 2,)."""
        return self.stride * np.arange(self.degree + 2)

    @cached_property
    def block_miss(self) -> np.ndarray:
        """Index in interval i's block of the misses before its first node to its last, (parts + 2,)."""
        return self._place(np.arange(-1, self.parts + 1))

    def _place(self, node: np.ndarray) -> np.ndarray:
        interval, part = np.divmod(node - 1, self.parts)
        return (interval + (self.degree + 3) // 2) * self.stride + 1 + part


def stretches(places: np.ndarray, margin: int, count: int, degree: int) -> np.ndarray:
    """Return the intervals between rows around coefficients: begin and end of each stretch, (k, 2).

    Args:
        places: Mask of the coefficients, (count + degree,).
        margin: Number of intervals before and behind them.
        count, degree: Numbers of intervals and degree of the rows.

    Example:
        >>> stretches(np.arange(23) == 8, 4, 20, 3)
        array([[ 1, 15]])
    """
    ends = np.zeros(count + 1, dtype=int)
    numbers = np.flatnonzero(places)
    np.add.at(ends, np.maximum(numbers - degree - margin, 0), 1)
    np.add.at(ends, np.minimum(numbers + 3 + margin, count), -1)
    inside = np.concatenate([[0], np.cumsum(ends[:-1]) > 0, [0]])
    change = np.diff(inside)
    return np.column_stack([np.flatnonzero(change == 1), np.flatnonzero(change == -1)])
