"""The part frame, and tool paths that are given in it."""

from __future__ import annotations

import numpy as np
from scipy.spatial.transform import Rotation

from coupling.path.frame import Frame
from coupling.path.histories import ToolPath

# Axes of an untilted tool in the part frame: x = -z (approach), y = y, z = x.
PART_FROM_TOOL = Rotation.from_matrix([[0.0, 0.0, 1.0], [0.0, 1.0, 0.0], [-1.0, 0.0, 0.0]])

# Axes of a tool at the sheet's back: x = z (approach), y = -y, z = x.
PART_FROM_SUPPORT = Rotation.from_matrix([[0.0, 0.0, 1.0], [0.0, -1.0, 0.0], [1.0, 0.0, 0.0]])


def tool_path(
    base_from_part: Frame,
    time: np.ndarray,
    points: np.ndarray,
    part_from_tool: Rotation = PART_FROM_TOOL,
) -> ToolPath:
    """Return the path of a tool that does not turn through points in the part frame [m], (n, 3)."""
    return ToolPath.with_rotation(time, points, part_from_tool).transformed(base_from_part)
