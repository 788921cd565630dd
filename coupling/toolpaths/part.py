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

# Axes closer than this to straight down have no shortest rotation from straight up.
_DOWN = 1e-6


def tool_path(
    base_from_part: Frame,
    time: np.ndarray,
    points: np.ndarray,
    part_from_tool: Rotation = PART_FROM_TOOL,
) -> ToolPath:
    """Return the path of a tool that does not turn through points in the part frame [m], (n, 3)."""
    return ToolPath.held(time, points, part_from_tool).transformed(base_from_part)


def upright(axis: np.ndarray) -> Rotation:
    """Return the rotations part_from_tool that turn an untilted tool the shortest way to tool axes.

    Each depends on its axis alone, so that a tool that comes back to an axis has turned about it by
    nothing.

    Args:
        axis: Unit vectors from the tool's tip to its holder, part frame [1], (n, 3).

    Raises:
        ValueError: If an axis points straight down.

    Example:
        >>> tool = upright(np.array([[0.0, 0.6, 0.8]]))
        >>> tool.apply([1.0, 0.0, 0.0]).round(9) + 0.0
        array([[ 0. , -0.6, -0.8]])
    """
    x, y, z = axis.T
    if np.any(1.0 + z < _DOWN):
        number = int(np.argmin(z)) + 1
        raise ValueError(
            f"expected tool axes that do not point straight down, got one at point {number}: turn the"
            " part frame"
        )
    shortest = Rotation.from_quat(np.column_stack([-y, x, np.zeros_like(x), 1.0 + z]))
    turned: Rotation = shortest * PART_FROM_TOOL
    return turned
