"""Test path with the elements of ISO 9283: squares, diagonal, large and small circle in one plane."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Literal

import numpy as np

from coupling.files.toml_file import Positive
from coupling.toolpaths.motion import SegmentedPath
from coupling.toolpaths.segments import Segment, circle, polyline

# Sizes relative to the side of the large square.  The standard asks for a small circle of a tenth
# and a large one of eight tenths of the test cube's side; the small square encloses the small circle.
_LARGE_CIRCLE = 0.8
_SMALL_SQUARE = 0.1


class Iso9283(SegmentedPath):
    """Squares, their diagonal and two circles, centred on the part frame, in its x-y plane.

    Keys: size_m, side of the large square; feed_m_s, blend_s of starts and stops, sample_s.  The
    plane is that of the part: incline it with the part's rpy_deg.
    """

    kind: Literal["iso9283"]
    size_m: Positive

    def _segments(self) -> Iterator[Segment]:
        half, small = 0.5 * self.size_m, 0.5 * _SMALL_SQUARE * self.size_m
        large = 0.5 * _LARGE_CIRCLE * self.size_m
        yield from _polygon(half)
        yield from _lines((half, half), (-half, -half), (large, 0.0))
        yield circle(np.zeros(3), large)
        yield from _lines((large, 0.0), (small, 0.0))
        yield circle(np.zeros(3), small)
        yield from _lines((small, 0.0), (small, small))
        yield from _polygon(small)


def _polygon(half: float) -> list[Segment]:
    """Square from its corner +x +y, back to there."""
    return _lines((half, half), (-half, half), (-half, -half), (half, -half), (half, half))


def _lines(*corners: tuple[float, float]) -> list[Segment]:
    return polyline(np.array([*corner, 0.0]) for corner in corners)
