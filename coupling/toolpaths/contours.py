"""Paths without a file: contours of cone and pyramid, lines, and the test path of ISO 9283."""

from __future__ import annotations

from abc import abstractmethod
from collections.abc import Iterable, Iterator
from dataclasses import replace
from typing import Annotated, Literal

import numpy as np
from pydantic import Field, model_validator

from coupling.files.toml_file import Positive, Vector3
from coupling.path.frame import Frame
from coupling.toolpaths.instants import NO_CORNERS, Corners
from coupling.toolpaths.motion import SegmentedPath
from coupling.toolpaths.segments import Segment, circle, link, polyline
from coupling.toolpaths.task import Task
from coupling.toolpaths.untilted import UntiltedPath

# Sizes relative to the side of the large square.  The standard asks for a small circle of a tenth
# and a large one of eight tenths of the test cube's side; the small square encloses the small circle.
_LARGE_CIRCLE = 0.8
_SMALL_SQUARE = 0.1


class _Contours(SegmentedPath):
    """Contours inside a wall of constant angle; depths of the TCP below the sheet's plane."""

    radius_m: Positive
    wall_angle_deg: Annotated[float, Field(gt=0.0, lt=90.0)]
    step_down_m: Positive
    depth_m: Positive
    clearance_m: Positive = 0.005

    @model_validator(mode="after")
    def _wall_ends_before_the_axis(self) -> _Contours:
        last = self._radius(self.depth_m)
        if last <= 0.0:
            most = self.radius_m * np.tan(np.deg2rad(self.wall_angle_deg))
            raise ValueError(
                f"depth_m: expected less than {most:.4g} m, got {self.depth_m} m, where the wall has"
                f" passed the axis by {-last:.4g} m"
            )
        return self

    @model_validator(mode="after")
    def _tool_comes_from_above(self) -> _Contours:
        least = self.untilted_lean_deg - 90.0
        if self.lean_deg <= least:
            raise ValueError(
                f"lean_deg: expected more than {least:g} from the wall's normal, as the tool comes from"
                f" above the sheet, got {self.lean_deg}"
            )
        return self

    @property
    def untilted_lean_deg(self) -> float:
        """The wall's angle where leans are measured from its normal: the wall is right of the feed."""
        return self.wall_angle_deg if self.tilt_frame == "path" else 0.0

    def task(
        self, part: Frame, corners: Corners = NO_CORNERS, untilted: UntiltedPath | None = None
    ) -> Task:
        """Return the task: a wall of this angle in steps."""
        angle = float(np.deg2rad(self.wall_angle_deg))
        return replace(
            super().task(part, corners, untilted), wall_angle=angle, step_down=self.step_down_m
        )

    def _segments(self) -> Iterator[Segment]:
        at = np.array([self._radius(0.0), 0.0, self.clearance_m])
        count = int(np.ceil(self.depth_m / self.step_down_m - 1e-9))
        yield link(at, start := np.array([at[0], 0.0, 0.0]))
        at = start
        for k in range(1, count + 1):
            depth = min(k * self.step_down_m, self.depth_m)
            start = np.array([self._radius(depth), 0.0, -depth])
            yield link(at, start)
            yield from self._contour(start)
            at = start
        yield link(at, np.array([at[0], 0.0, self.clearance_m]))

    def _radius(self, depth: float) -> float:
        return self.radius_m - depth / float(np.tan(np.deg2rad(self.wall_angle_deg)))

    @abstractmethod
    def _contour(self, start: np.ndarray) -> Iterable[Segment]:
        """Return the closed contour from its first point."""


class Cone(_Contours):
    """Circles about the part's z axis.

    Keys: radius_m of the TCP's path at the sheet's plane, wall_angle_deg from that plane,
    step_down_m between contours, depth_m of the last one, feed_m_s, blend_s of starts and stops,
    clearance_m of air moves, sample_s.
    """

    kind: Literal["cone"]

    def _contour(self, start: np.ndarray) -> Iterable[Segment]:
        return [circle(np.array([0.0, 0.0, start[2]]), float(start[0]))]


class Pyramid(_Contours):
    """Squares about the part's z axis; keys as for the cone, radius_m being half the side."""

    kind: Literal["pyramid"]

    def _contour(self, start: np.ndarray) -> Iterable[Segment]:
        r, z = float(start[0]), float(start[2])
        corners = [(r, 0.0), (r, r), (-r, r), (-r, -r), (r, -r), (r, 0.0)]
        return polyline(np.array([*corner, z]) for corner in corners)


class Line(SegmentedPath):
    """Lines from point to point, at rest in each.

    Keys: points_m, at least two in the part frame; feed_m_s, blend_s, sample_s as for the cone.
    """

    kind: Literal["line"]
    points_m: Annotated[list[Vector3], Field(min_length=2)]

    @model_validator(mode="after")
    def _points_differ(self) -> Line:
        for k, (a, b) in enumerate(zip(self.points_m, self.points_m[1:], strict=False), start=1):
            if a == b:
                raise ValueError(
                    f"points_m: expected a way between points {k} and {k + 1}, got {a} for both"
                )
        return self

    def _segments(self) -> list[Segment]:
        return polyline(np.array(self.points_m))


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
