"""A tool that does not stand upright on its part."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy.spatial.transform import Rotation

from coupling.path.histories import ToolPath, poses
from coupling.toolpaths.part import Part

# Axis of approach in the tool's own axes.
APPROACH = np.array([1.0, 0.0, 0.0])
# Largest difference of a tool's orientations along a path that keeps it [rad].
_SAME = 1e-9


@dataclass(frozen=True)
class ToolTilt:
    """How a tool is turned from the orientation that its path gives it, the same all along the path.

    R = Rx(lean) Ry(lead) R_path Rx(rotation): lead and lean about the y and x axes of the part, the
    rotation about the tool's own axis of approach.

    Attributes:
        lead, lean, rotation: [rad].

    Example:
        >>> down = ToolTilt(lead=np.pi / 2).part_from_tool(Rotation.from_euler("y", np.pi / 2))
        >>> down.apply(APPROACH).round(9) + 0.0
        array([-1.,  0.,  0.])
    """

    lead: float = 0.0
    lean: float = 0.0
    rotation: float = 0.0

    def part_from_tool(self, along_path: Rotation) -> Rotation:
        """Return the orientation of the tool that a path holds at `along_path`."""
        turn: Rotation = Rotation.from_euler("yx", [self.lead, self.lean])
        return turn * along_path * Rotation.from_rotvec(self.rotation * APPROACH)

    def along_path(self, part_from_tool: Rotation) -> Rotation:
        """Return the orientation that a path gives a tool which it holds at `part_from_tool`."""
        turn = Rotation.from_euler("yx", [self.lead, self.lean])
        given: Rotation = (
            turn.inv() * part_from_tool * Rotation.from_rotvec(-self.rotation * APPROACH)
        )
        return given

    def path(self, part: Part, path: ToolPath) -> ToolPath:
        """Return the path of one tool with its tool turned, in the frame of the path."""
        if self == UPRIGHT:
            return path
        along_path = part.rotation.inv() * path.rotations[0]
        turned = part.rotation * self.part_from_tool(along_path)
        return ToolPath(path.time, poses(path.position[0], turned))

    def contact(self, part: Part, path: ToolPath) -> np.ndarray:
        """Return where the lowest point of a tool's sphere is, seen from the sphere's centre.

        Args:
            part: Placement of the part.
            path: Path of the tool before it was turned.

        Returns:
            Unit vector in the tool's axes, (3,); that of its approach if it stands upright.

        Raises:
            ValueError: If the tool leans and does not keep its orientation along the path: it then has
                no such point.
        """
        if self.lead == 0.0 and self.lean == 0.0:
            return APPROACH.copy()
        along_path = part.rotation.inv() * path.rotations[0]
        first = along_path[0]
        if (along_path * first.inv()).magnitude().max() > _SAME:
            raise ValueError(
                "expected a path along which the tool keeps its orientation, as the TCP is its sphere's"
                " lowest point, got one that turns it: write lead and lean into its orientations"
            )
        lowest: np.ndarray = self.part_from_tool(first).inv().apply(first.apply(APPROACH))
        return lowest


UPRIGHT = ToolTilt()
