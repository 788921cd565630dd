"""The path of a supporting tool at the sheet's back, derived from that of the forming tool."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace

import numpy as np

from coupling.path.frame import Frame
from coupling.path.histories import ToolPath
from coupling.path.interpolation import InterpolatedPath
from coupling.path.linear import interpolate_rows
from coupling.toolpaths.part import PART_FROM_SUPPORT, tool_path


@dataclass(frozen=True)
class SupportingTool:
    """Desired path of the supporting tool.

    Attributes:
        forming: Desired path of the forming tool.
        desired: Path of its own TCP, the tip of its sphere.
        direction: Unit vectors across the sheet, from the forming tool's side to its back, in the
            frame of the path, (n, 3).
        gap: Commanded gap between the surfaces of both tools, across the sheet [m].
        tool_diameter: Diameter of its sphere [m].
    """

    forming: ToolPath
    desired: ToolPath
    direction: np.ndarray
    gap: float
    tool_diameter: float

    def opening(self, path: ToolPath) -> np.ndarray:
        """Return by how much the gap between two tools is wider than commanded [m], (n,).

        Args:
            path: Actual path of both tools, forming tool first; at the times of the desired ones, or
                any between them.
        """
        tool_path = self.at(path.time)
        forming, supporting = path.position
        drift = (supporting - tool_path.desired.position[0]) - (
            forming - tool_path.forming.position[0]
        )
        return np.sum(drift * tool_path.direction, axis=1)

    def at_rows(self, rows: np.ndarray) -> SupportingTool:
        """Return the same at the times of these row numbers, (k,)."""
        forming, desired = self.forming.at_rows(rows), self.desired.at_rows(rows)
        return replace(self, forming=forming, desired=desired, direction=self.direction[rows])

    def at(self, time: np.ndarray) -> SupportingTool:
        """Return the same at other times between the first and the last [s], (k,)."""
        if np.array_equal(time, self.forming.time):
            return self
        forming, desired = (
            InterpolatedPath(path).at(time) for path in (self.forming, self.desired)
        )
        across = interpolate_rows(time, self.forming.time, self.direction)
        direction = across / np.linalg.norm(across, axis=1, keepdims=True)
        return replace(self, forming=forming, desired=desired, direction=direction)


@dataclass(frozen=True)
class Pinch:
    """Two spheres on both sides of a wall.

    Attributes:
        wall_angle: Angle of the wall from the sheet's plane [rad]; 0 for a flat bottom.
        gap: Distance of the spheres' surfaces across the wall [m].
        forming_diameter, support_diameter: Diameters of the spheres [m].
    """

    wall_angle: float
    gap: float
    forming_diameter: float
    support_diameter: float


def following(points: np.ndarray, depth: np.ndarray, pinch: Pinch) -> tuple[np.ndarray, np.ndarray]:
    """Return points [m] opposite the forming tool, and directions across the wall, (n, 3), part frame.

    Both spheres touch the sheet along its normal, which tilts from the vertical to the wall's as the
    wall grows; until then the supporting tool stays below the flat sheet.
    """
    # Distance of the centres.
    reach = 0.5 * pinch.forming_diameter + pinch.gap + 0.5 * pinch.support_diameter
    cos = np.maximum(np.cos(pinch.wall_angle), 1.0 - depth / reach)
    sin = np.sqrt(1.0 - cos**2)
    direction = sin[:, None] * _outward(points)
    direction[:, 2] = -cos
    tips = points + reach * direction
    tips[:, 2] = -depth + reach * (1.0 - cos) - pinch.gap
    return tips, direction


def fixed_height(
    points: np.ndarray, depth: np.ndarray, pinch: Pinch
) -> tuple[np.ndarray, np.ndarray]:
    """Return points and directions as `following`, (n, 3): the same turn about z, no descent."""
    tips = points + (depth / np.tan(pinch.wall_angle))[:, None] * _outward(points)
    tips[:, 2] = -pinch.gap
    return tips, np.tile([0.0, 0.0, -1.0], (len(points), 1))


# Forming points in the part frame (n, 3), depth so far (n,) and the tools -> points of the supporting
# tool and directions across the sheet, part frame.
Strategy = Callable[[np.ndarray, np.ndarray, Pinch], tuple[np.ndarray, np.ndarray]]

STRATEGIES: dict[str, Strategy] = {"following": following, "fixed-height": fixed_height}


def support_along(
    strategy: str, part: Frame, forming: ToolPath, height: float, pinch: Pinch
) -> SupportingTool:
    """Return the desired path of a supporting tool along a forming path.

    Args:
        strategy: A name in STRATEGIES.
        part: base_from_part.
        forming: Desired path of the forming tool.
        height: Height of its TCP above the lowest point of its sphere, along the part's z axis [m].
        pinch: The tools.
    """
    points = part.coordinates(forming.position[0]) - [0.0, 0.0, height]
    # The sheet stays formed when the forming tool leaves it.
    depth = np.maximum.accumulate(np.maximum(-points[:, 2], 0.0))
    tips, direction = STRATEGIES[strategy](points, depth, pinch)
    path = tool_path(part, forming.time, tips, PART_FROM_SUPPORT)
    across = part.rotate(direction)
    return SupportingTool(forming, path, across, pinch.gap, pinch.support_diameter)


def _outward(points: np.ndarray) -> np.ndarray:
    """Unit vectors away from the part's z axis, (n, 3); zero on it."""
    outward = points * [1.0, 1.0, 0.0]
    return outward / np.maximum(np.linalg.norm(outward, axis=1, keepdims=True), 1e-12)
