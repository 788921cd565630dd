"""The part frame, and tool paths that are given in it."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy.spatial.transform import Rotation

from coupling.path.histories import ToolPath

# Axes of an upright tool in the part frame: x = -z (approach), y = y, z = x.
PART_FROM_TOOL = Rotation.from_matrix([[0.0, 0.0, 1.0], [0.0, 1.0, 0.0], [-1.0, 0.0, 0.0]])

# Axes of a tool at the sheet's back: x = z (approach), y = -y, z = x.
_PART_FROM_SUPPORT = Rotation.from_matrix([[0.0, 0.0, 1.0], [0.0, -1.0, 0.0], [1.0, 0.0, 0.0]])


@dataclass(frozen=True)
class Part:
    """Placement of the part in the robot's base; the sheet lies in the part's x-y plane.

    Attributes:
        position: Origin of the part frame [m], (3,).
        rotation: base_from_part.
    """

    position: np.ndarray
    rotation: Rotation

    def tool_path(self, time: np.ndarray, points: np.ndarray) -> ToolPath:
        """Return the path through points given in the part frame [m], (n, 3).

        The tool keeps its orientation: its x axis points into the sheet.
        """
        return self._path(time, points, PART_FROM_TOOL)

    def support_path(self, time: np.ndarray, points: np.ndarray) -> ToolPath:
        """Return the path of a tool at the sheet's back: its x axis points the other way."""
        return self._path(time, points, _PART_FROM_SUPPORT)

    def _path(self, time: np.ndarray, points: np.ndarray, part_from_tool: Rotation) -> ToolPath:
        position = self.position + self.rotation.apply(points)
        quaternion = (self.rotation * part_from_tool).as_quat()
        quaternion = quaternion if quaternion[3] >= 0.0 else -quaternion
        return ToolPath(time, np.hstack([position, np.tile(quaternion, (len(time), 1))]))

    def coordinates(self, position: np.ndarray) -> np.ndarray:
        """Return positions of the base frame in the part frame [m], both (n, 3)."""
        in_part: np.ndarray = self.rotation.inv().apply(position - self.position)
        return in_part
