"""Straight lines through points of the part frame."""

from __future__ import annotations

from typing import Annotated, Literal

import numpy as np
from pydantic import Field, model_validator

from coupling.files.toml_file import Positive, Vector3
from coupling.path.histories import ToolPath
from coupling.toolpaths.motion import follow, polyline
from coupling.toolpaths.part import Part
from coupling.toolpaths.task import ToolPathTable


class Line(ToolPathTable):
    """Lines from point to point, at rest in each.

    Keys: points_m, at least two in the part frame; feed_m_s, blend_s, sample_s as for the cone.
    """

    kind: Literal["line"]
    points_m: Annotated[list[Vector3], Field(min_length=2)]
    feed_m_s: Positive
    blend_s: Positive = 0.2
    sample_s: Positive = 0.02

    @model_validator(mode="after")
    def _points_differ(self) -> Line:
        for k, (a, b) in enumerate(zip(self.points_m, self.points_m[1:], strict=False), start=1):
            if a == b:
                raise ValueError(
                    f"points_m: points {k} and {k + 1} are both {a}; needed are different"
                )
        return self

    def path(self, part: Part) -> ToolPath:
        """Return the tool path in the robot's base frame."""
        segments = polyline(np.array(self.points_m))
        time, samples = follow(segments, self.feed_m_s, self.blend_s, self.sample_s)
        return part.tool_path(time, samples)
