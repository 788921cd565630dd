"""Tilt of a tool on its part."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy.spatial.transform import Rotation

# Axis of approach in the tool's own axes.
APPROACH = np.array([1.0, 0.0, 0.0])


@dataclass(frozen=True)
class ToolTilt:
    """Rotation of a tool from the orientation that its path gives it, the same all along the path.

    R = A Rx(lean) Ry(lead) A^-1 R_path Rx(rotation), A the axes that lead and lean are measured in,
    those of the part or of the feed: lead about y first, then lean about x, the rotation about the
    tool's own axis of approach.  In axes of the feed, x along it and z away from the part, a positive
    lead lets the tool lean forward, a positive lean to the right, as in five-axis milling.

    Attributes:
        lead, lean, rotation: Angles [rad].

    Example:
        >>> down = ToolTilt(lead=np.pi / 2).part_from_tool(Rotation.from_euler("y", np.pi / 2))
        >>> down.apply(APPROACH).round(9) + 0.0
        array([-1.,  0.,  0.])
    """

    lead: float = 0.0
    lean: float = 0.0
    rotation: float = 0.0

    @property
    def keeps_axis(self) -> bool:
        """Whether the tool's axis stays where the path has it."""
        return self.lead == 0.0 and self.lean == 0.0

    def part_from_tool(self, along_path: Rotation, axes: Rotation | None = None) -> Rotation:
        """Return the orientation of the tool that a path holds at `along_path`.

        Args:
            along_path: Orientations that the path gives, in the part.
            axes: Axes of lead and lean in the part, one or as many; None: the part's.
        """
        turn: Rotation = Rotation.from_euler("yx", [self.lead, self.lean])
        if axes is not None:
            turn = axes * turn * axes.inv()
        return turn * along_path * Rotation.from_rotvec(self.rotation * APPROACH)
