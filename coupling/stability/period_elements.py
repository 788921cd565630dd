"""Elements of a period of a cut: between its corners, with as many points as the modes' waves need."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from functools import cached_property

import numpy as np

from coupling.errors import StabilityError
from coupling.stability.spectral_element import ElementRule, element_rule
from coupling.stability.steady_cut import Channel, SteadyCut
from coupling.stability.structure import Structure

# Points of an element: so many, and more for each radian of the fastest mode within it.
_POINTS, _PER_RADIAN = 6, 0.6
# An element with more of them is divided.
_MOST_POINTS = 28
# Points at most: more are a cut that is too slow for its fastest mode.
_MOST_IN_ALL = 1200


@dataclass(frozen=True)
class PeriodElement:
    """Part of a period within which a channel's gain is smooth.

    Attributes:
        channel: The channel.
        begin: Its beginning [s].
        length: Its duration [s].
        rule: Its points.
        first: Number of its first point among all.
    """

    channel: Channel
    begin: float
    length: float
    rule: ElementRule
    first: int

    @cached_property
    def time(self) -> np.ndarray:
        """Times of its points [s], (p,)."""
        return self.begin + self.length * self.rule.points


@dataclass(frozen=True)
class _Piece:
    """Part of a period within which a channel's gain is smooth, divided into elements of one length.

    Attributes:
        begin: Its beginning [s].
        length: Duration of an element [s].
        parts: Number of its elements.
        points: Number of points of each.
    """

    channel: Channel
    begin: float
    length: float
    parts: int
    points: int


def points_of(structure: Structure, cut: SteadyCut) -> int:
    """Return the number of points that the growth in a cut takes: its effort goes with their square."""
    return sum(piece.parts * piece.points for piece in _divided(structure, cut, 1.0))


def period_elements(
    structure: Structure, cut: SteadyCut, refined: float
) -> tuple[PeriodElement, ...]:
    """Return the elements of a period.

    Args:
        structure: Modes of robot and tool.
        cut: The cut.
        refined: Factor of the number of points.

    Raises:
        StabilityError: If the cut is too slow for the fastest mode.
    """
    pieces = list(_divided(structure, cut, refined))
    total = sum(piece.parts * piece.points for piece in pieces)
    if total > _MOST_IN_ALL:
        waves = structure.fastest / (2.0 * np.pi)
        most = waves * cut.period * _MOST_IN_ALL / total
        raise StabilityError(
            f"stability at {cut.rpm:.4g} 1/min: expected at most some {most:.0f} waves of the"
            f" fastest mode, {waves:.4g} Hz, in {1e3 * cut.period:.3g} ms, a period of the cut,"
            f" got {waves * cut.period:.4g}: raise the speed, or leave out the tool's fastest modes"
        )
    elements: list[PeriodElement] = []
    first = 0
    for piece in pieces:
        rule = element_rule(piece.points)
        for part in range(piece.parts):
            begin = piece.begin + part * piece.length
            elements.append(PeriodElement(piece.channel, begin, piece.length, rule, first))
            first += piece.points
    return tuple(elements)


def _divided(structure: Structure, cut: SteadyCut, refined: float) -> Iterator[_Piece]:
    """Yield the pieces of a cut with the elements that its waves need."""
    for channel in cut.channels:
        for begin, end in channel.pieces.tolist():
            radians = (end - begin) * structure.fastest
            points = refined * (_POINTS + _PER_RADIAN * radians)
            parts = int(np.ceil(points / _MOST_POINTS))
            count = int(np.ceil(points / parts)) + (2 if parts > 1 else 0)
            yield _Piece(channel, begin, (end - begin) / parts, parts, count)
