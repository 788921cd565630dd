"""The part that a tool shapes, and when it shapes which of its places."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy.spatial import cKDTree

from coupling.path.frame import Frame
from coupling.path.histories import ToolPath, WrenchHistory
from coupling.path.linear import arc_length, interpolate_rows
from coupling.results.scene import SceneTool
from coupling.toolpaths.tilt import APPROACH

# Cells around the part, corners of its surface, and points of the path that is swept, at most.
_CELLS, _CORNERS, _POINTS = 20_000, 8000, 60_000
# A first look has so many fewer cells.
_COARSE = 5
# Times that are the same [s].
_SAME = 1e-9
# The tool works where its force is at least this part of the largest one, or was within this time [s].
_WORKS, _SOON = 0.02, 0.1
# A flat tool stands upright where the cosine of its tilt is at least this.
_UPRIGHT = 0.999
# Pairs of points and cells that are looked at together.
_AT_ONCE = 2_000_000
# A tool is at least this wide in cells, so that its passes leave no gaps.
_WIDE = 0.75


@dataclass(frozen=True)
class ShapedPart:
    """Surface that a tool leaves on its desired path, in triangles.

    Attributes:
        points: Corners in the part's frame [m], (n, 3).
        triangles: Numbers of their corners, (m, 3).
        time: Time at which the tool shapes each corner last [s], (n,).
    """

    points: np.ndarray
    triangles: np.ndarray
    time: np.ndarray

    def nearest_to(self, points: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Return what is above or below points of the part's frame.

        Args:
            points: Points [m], (k, 3).

        Returns:
            Heights [m] and times [s] of the surface there, NaN beside it, (k,) each.
        """
        distance, corner = cKDTree(self.points[:, :2]).query(points[:, :2])
        cell = np.sqrt(np.prod(np.ptp(self.points[:, :2], axis=0)) / len(self.points))
        is_beside = distance > 2.0 * cell
        height, time = self.points[corner, 2], self.time[corner]
        return np.where(is_beside, np.nan, height), np.where(is_beside, np.nan, time)


def shaped_part(
    desired: ToolPath, wrench: WrenchHistory, world_from_part: Frame, tool: SceneTool
) -> ShapedPart | None:
    """Return the lowest surface that a tool sweeps while it works; None where it leaves none.

    Args:
        desired: Path of one tool's end, world frame.
        wrench: Wrench on it.
        world_from_part: Frame of the part, whose z axis points away from it.
        tool: Shape of the tool.
    """
    tip = world_from_part.coordinates(desired.position[0])
    shaft = world_from_part.rotation.inv().apply(-desired.rotations[0].apply(APPROACH))
    works = _works(desired.time, wrench)
    if not works.any() or (not tool.is_round and shaft[works, 2].min() < _UPRIGHT):
        return None
    # Of a ball its centre, of a flat tool its end.
    middle = tip + 0.5 * tool.diameter * shaft if tool.is_round else tip
    # What is above both the part's plane and the highest point at which the tool works it leaves.
    top = max(float(tip[_works(desired.time, wrench, 0.0), 2].max(initial=0.0)), 0.0)
    sweep = _Sweep(desired.time, middle, works, 0.5 * tool.diameter, tool.is_round)
    coarse = sweep.surface(_CELLS // _COARSE, top)
    if coarse is None:
        return None
    return sweep.surface(min(_CELLS, _CELLS * _CORNERS // (_COARSE * len(coarse.points))), top)


def _works(time: np.ndarray, wrench: WrenchHistory, soon: float = _SOON) -> np.ndarray:
    """Return in which rows of a path the tool works or is about to [s], a mask, (n,)."""
    force = np.linalg.norm(wrench.force[0], axis=1)
    busy = wrench.time[(force > _WORKS * force.max()) & (force > 0.0)]
    until = np.searchsorted(busy, time + soon + _SAME, side="right")
    after = np.searchsorted(busy, time - soon - _SAME, side="left")
    mask: np.ndarray = until > after
    return mask


@dataclass(frozen=True)
class _Sweep:
    """A ball, or a flat end, on its way over the part.

    Attributes:
        time: Times [s], (n,).
        middle: Centre of the ball or of the flat end, part's frame [m], (n, 3).
        works: Whether it works, (n,).
        radius: Radius of the tool [m].
        is_round: Whether it is a ball.
    """

    time: np.ndarray
    middle: np.ndarray
    works: np.ndarray
    radius: float
    is_round: bool

    def surface(self, cells: int, top: float) -> ShapedPart | None:
        """Return the lowest surface below `top` [m], on so many cells around the part; None without."""
        low = self.middle[self.works, :2].min(axis=0) - self.radius
        extent = self.middle[self.works, :2].max(axis=0) + self.radius - low
        cell = float(np.sqrt(np.prod(extent) / cells))
        height, last = self._lowest(low, cell, np.ceil(extent / cell).astype(int) + 1)
        is_there = height <= top
        number = np.where(is_there, np.cumsum(is_there).reshape(height.shape) - 1, -1)
        a, b, c, d = number[:-1, :-1], number[1:, :-1], number[1:, 1:], number[:-1, 1:]
        # Both ways to halve a quadrangle: where a corner is missing one half of one of them is left.
        halves = [(a, b, c), (a, c, d), (a, b, d), (b, c, d)]
        whole = (np.stack([a, b, c, d]) >= 0).all(axis=0)
        kept = [np.stack(half, axis=-1)[whole] for half in halves[:2]]
        for half in halves:
            corners = np.stack(half, axis=-1)
            kept.append(corners[(corners >= 0).all(axis=-1) & ~whole])
        triangles = np.vstack(kept)
        if len(triangles) == 0:
            return None
        x, y = np.nonzero(is_there)
        points = np.column_stack([low[0] + cell * x, low[1] + cell * y, height[is_there]])
        return ShapedPart(points, triangles, last[is_there])

    def _lowest(
        self, low: np.ndarray, cell: float, shape: np.ndarray
    ) -> tuple[np.ndarray, np.ndarray]:
        """Return lowest heights [m] and their times [s] in cells, (x, y); infinite where no tool was."""
        radius = max(self.radius, _WIDE * cell)
        middle, time = self._in_steps(0.5 * cell)
        wide = int(radius / cell) + 1
        offset = np.arange(-wide, wide + 1)
        height = np.full(int(np.prod(shape)), np.inf)
        last = np.full(len(height), np.nan)
        pieces = len(middle) * len(offset) ** 2 // _AT_ONCE + 1
        for some in np.array_split(np.arange(len(middle)), pieces):
            centre = middle[some, :2, None]
            number = np.round((centre - low[:, None]) / cell).astype(int) + offset
            x, y = np.moveaxis(number * cell + low[:, None] - centre, 1, 0)
            away = np.sqrt((x * x)[:, None] + (y * y)[:, :, None])
            is_on_part = (number >= 0) & (number < shape[:, None])
            there = (away <= radius) & is_on_part[:, 0, None] & is_on_part[:, 1, :, None]
            row, of_y, of_x = np.nonzero(there)
            which = number[row, 0, of_x] * shape[1] + number[row, 1, of_y]
            point = some[row]
            drop = np.sqrt(radius**2 - away[there] ** 2) if self.is_round else 0.0
            reached = middle[point, 2] - drop
            np.minimum.at(height, which, reached)
            is_lowest = reached <= height[which]
            last[which[is_lowest]] = time[point[is_lowest]]
        return height.reshape(shape), last.reshape(shape)

    def _in_steps(self, step: float) -> tuple[np.ndarray, np.ndarray]:
        """Return centres [m], (k, 3), and times [s], (k,), a step [m] apart, where the tool works."""
        length = arc_length(self.middle)
        rows = np.arange(len(length), dtype=float)
        count = min(int(length[-1] / step) + 2, _POINTS)
        at = np.interp(np.linspace(0.0, length[-1], count), length, rows)
        at = at[self.works[np.round(at).astype(int)]]
        return interpolate_rows(at, rows, self.middle), np.interp(at, rows, self.time)
