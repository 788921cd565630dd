"""Curves by arc length: straight lines, circles, and curves joined end to end."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass
from itertools import pairwise
from typing import Protocol

import numpy as np

# A straight segment that goes less far than this across the part's z axis is along it [m].
_VERTICAL_TOLERANCE = 1e-9

Function = Callable[[np.ndarray], np.ndarray]


class Segment(Protocol):
    """A smooth curve by its arc length [m]."""

    @property
    def length(self) -> float:
        """Arc length [m]."""

    @property
    def point(self) -> Function:
        """Function from arc lengths (k,) to points (k, 3) [m]."""

    @property
    def heading(self) -> Function | None:
        """Function from arc lengths to angles of the feed about the z axis from x [rad], (k,).

        None where the tool only moves from one cut to the next, and keeps the last heading.
        """


@dataclass(frozen=True)
class Curve:
    """A curve by its functions; attributes as of `Segment`."""

    length: float
    point: Function
    heading: Function | None = None


@dataclass(frozen=True, slots=True)
class Straight:
    """The straight segment between two points; programs have many, so it holds no more than these.

    Attributes:
        start, end: The points [m], (3,), which differ.
        is_link: Whether the tool only moves to the next cut.
    """

    start: np.ndarray
    end: np.ndarray
    is_link: bool = False

    @property
    def length(self) -> float:
        """Arc length [m]."""
        return float(np.linalg.norm(self.end - self.start))

    def point(self, s: np.ndarray) -> np.ndarray:
        """Return points [m], (k, 3), at arc lengths (k,) [m]."""
        points: np.ndarray = self.start + np.outer(s, (self.end - self.start) / self.length)
        return points

    @property
    def heading(self) -> Function | None:
        """Function from arc lengths to the angle of the feed [rad]; None along the z axis."""
        direction = (self.end - self.start) / self.length
        if self.is_link or np.linalg.norm((self.end - self.start)[:2]) < _VERTICAL_TOLERANCE:
            return None
        angle = float(np.arctan2(direction[1], direction[0]))
        return lambda s: np.full_like(s, angle)


def straight(start: np.ndarray, end: np.ndarray) -> Straight:
    """Return the straight segment between two points [m], (3,); without heading along the z axis."""
    return Straight(start, end)


def link(start: np.ndarray, end: np.ndarray) -> Straight:
    """Return the straight segment between two cuts [m], (3,)."""
    return Straight(start, end, is_link=True)


def polyline(points: Iterable[np.ndarray]) -> list[Segment]:
    """Return the straight segments from point to point [m], (3,) each."""
    return [straight(start, end) for start, end in pairwise(points)]


def circle(center: np.ndarray, radius: float) -> Curve:
    """Return a full horizontal circle about the z axis through `center` [m], (3,), from +x on."""

    def point(s: np.ndarray) -> np.ndarray:
        angle = s / radius
        return center + radius * np.column_stack([np.cos(angle), np.sin(angle), np.zeros_like(s)])

    return Curve(2.0 * np.pi * radius, point, lambda s: 0.5 * np.pi + s / radius)


class Chain:
    """Segments joined end to end, as one curve.

    Args:
        segments: At least one.

    Attributes:
        lengths: Their lengths [m], (n,).

    Example:
        >>> corner = Chain(polyline(np.array([[0.0, 0, 0], [2.0, 0, 0], [2.0, 1.0, 0]])))
        >>> corner.length, corner.point(np.array([1.0, 2.5]))
        (3.0, array([[1. , 0. , 0. ],
               [2. , 0.5, 0. ]]))
    """

    def __init__(self, segments: Sequence[Segment]) -> None:
        count = len(segments)
        straights = {k: line for k, line in enumerate(segments) if isinstance(line, Straight)}
        rows, lines = list(straights), straights.values()
        self._start, self._direction = np.zeros((count, 3)), np.zeros((count, 3))
        self._start[rows] = np.reshape([line.start for line in lines], (-1, 3))
        ways = np.reshape([line.end for line in lines], (-1, 3)) - self._start[rows]
        self.lengths = np.zeros(count)
        self.lengths[rows] = np.linalg.norm(ways, axis=1)
        self._direction[rows] = ways / self.lengths[rows, None]
        self._curves = {
            k: segment for k, segment in enumerate(segments) if not isinstance(segment, Straight)
        }
        for k, curve in self._curves.items():
            self.lengths[k] = curve.length
        self._ends = np.cumsum(self.lengths)

    @property
    def length(self) -> float:
        """Arc length [m]."""
        return float(self._ends[-1])

    def point(self, s: np.ndarray) -> np.ndarray:
        """Return points [m], (k, 3), at rising arc lengths [m], (k,)."""
        return self.points_at(*self.place(s))

    def place(self, s: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Return numbers of segments, rising, and ways within them [m], (k,), at rising arc lengths."""
        # What rounding takes back at an end is a way that stays.
        s = np.maximum.accumulate(s)
        which = np.searchsorted(self._ends, s, side="left").clip(max=len(self._ends) - 1)
        begin = self._ends - self.lengths
        return which, np.clip(s - begin[which], 0.0, self.lengths[which])

    def points_at(self, which: np.ndarray, way: np.ndarray) -> np.ndarray:
        """Return points [m], (k, 3), by `place`."""
        points: np.ndarray = self._direction[which]
        points *= way[:, None]
        points += self._start[which]
        numbers = np.array(list(self._curves), dtype=int)
        first, last = (np.searchsorted(which, numbers, side=side) for side in ("left", "right"))
        for k, a, b in zip(numbers.tolist(), first.tolist(), last.tolist(), strict=True):
            if b > a:
                points[a:b] = self._curves[k].point(way[a:b])
        return points
