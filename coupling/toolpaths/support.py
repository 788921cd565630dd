"""The path of a supporting tool at the sheet's back, derived from that of the forming tool."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from coupling.path.histories import ToolPath
from coupling.toolpaths.part import Part


@dataclass(frozen=True)
class Support:
    """What the supporting tool is to do.

    Attributes:
        desired: Path of its TCP, the tip of its sphere.
        direction: Unit vectors across the sheet, from the forming tool's side to its back, in the
            frame of the path, (n, 3).
        gap: Commanded between the surfaces of both tools, across the sheet [m].
        tool_diameter: Of its sphere [m].
    """

    desired: ToolPath
    direction: np.ndarray
    gap: float
    tool_diameter: float

    def opening(self, path: ToolPath, desired: ToolPath) -> np.ndarray:
        """Return by how much the gap between two tools is wider than commanded [m], (n,).

        Args:
            path: Of both tools, forming tool first.
            desired: Of the forming tool.
        """
        forming, supporting = path.tools
        drift = (supporting.position - self.desired.position) - (
            forming.position - desired.position
        )
        return np.sum(drift * self.direction, axis=1)


# Forming points in the part frame (n, 3), depth so far (n,), wall angle, gap, diameters of forming
# and supporting tool -> points of the supporting tool and directions across the sheet, part frame.
Strategy = Callable[
    [np.ndarray, np.ndarray, float, float, float, float], tuple[np.ndarray, np.ndarray]
]


def following(
    points: np.ndarray,
    depth: np.ndarray,
    wall_angle: float,
    gap: float,
    forming_diameter: float,
    support_diameter: float,
) -> tuple[np.ndarray, np.ndarray]:
    """Return the points opposite the forming tool across the wall.

    Both spheres touch the sheet along its normal, which tilts from the vertical to the wall's as the
    wall grows; until then the supporting tool stays below the flat sheet.
    """
    reach = 0.5 * forming_diameter + gap + 0.5 * support_diameter  # between the centres
    cos = np.maximum(np.cos(wall_angle), 1.0 - depth / reach)
    sin = np.sqrt(1.0 - cos**2)
    direction = sin[:, None] * _outward(points)
    direction[:, 2] = -cos
    tips = points + reach * direction
    tips[:, 2] = -depth + reach * (1.0 - cos) - gap
    return tips, direction


def fixed_height(
    points: np.ndarray,
    depth: np.ndarray,
    wall_angle: float,
    gap: float,
    forming_diameter: float,
    support_diameter: float,
) -> tuple[np.ndarray, np.ndarray]:
    """Return the points below the rim of the wall: the same turn about the z axis, no descent."""
    tips = points + (depth / np.tan(wall_angle))[:, None] * _outward(points)
    tips[:, 2] = -gap
    return tips, np.tile([0.0, 0.0, -1.0], (len(points), 1))


STRATEGIES: dict[str, Strategy] = {"following": following, "fixed-height": fixed_height}


def support_along(
    strategy: str,
    part: Part,
    desired: ToolPath,
    wall_angle: float,
    gap: float,
    forming_diameter: float,
    support_diameter: float,
) -> Support:
    """Return what a supporting tool is to do along a forming path.

    Args:
        strategy: A name in STRATEGIES.
        part: Placement of the part.
        desired: Of the forming tool.
        wall_angle: Of the wall from the sheet's plane [rad]; 0 for a flat bottom.
        gap: Between the surfaces of both tools [m].
        forming_diameter, support_diameter: Of the tools' spheres [m].
    """
    points = part.coordinates(desired)
    # The sheet stays formed when the forming tool leaves it.
    depth = np.maximum.accumulate(np.maximum(-points[:, 2], 0.0))
    tips, direction = STRATEGIES[strategy](
        points, depth, wall_angle, gap, forming_diameter, support_diameter
    )
    path = part.support_path(desired.time, tips)
    return Support(path, part.rotation.apply(direction), gap, support_diameter)


def _outward(points: np.ndarray) -> np.ndarray:
    """Unit vectors away from the part's z axis, (n, 3); zero on it."""
    outward = points * [1.0, 1.0, 0.0]
    return outward / np.maximum(np.linalg.norm(outward, axis=1, keepdims=True), 1e-12)
