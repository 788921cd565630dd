"""Straight lines through points of the part frame."""

from __future__ import annotations

from typing import Annotated, Literal

import numpy as np
from pydantic import Field, model_validator

from coupling.files.toml_file import Vector3
from coupling.toolpaths.motion import SegmentedPath
from coupling.toolpaths.segments import Segment, polyline


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
