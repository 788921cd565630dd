"""Stock that a mill removes along its path: a raster that knows where its material ends within a cell.

The height of the part is cut into layers. A layer holds, for each cell, the distance of its middle from
the material's border [m], positive in the material, so that borders lie between cells and not on them.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from itertools import pairwise

import numpy as np
from scipy.spatial import cKDTree

from coupling.path.linear import arc_length

# Cells in a radius of the cutter, and cells of all layers at most.
_PER_RADIUS, _MOST_CELLS = 40, 20_000_000
# Layers in a radius, and layers at most.
_LAYERS_PER_RADIUS, _MOST_LAYERS = 8, 64
# Layers between two passes down over each other; they are near within so many radii, and another pass
# after so many radii of way.
_PER_PASS, _NEAR, _ANOTHER = 3, 0.5, 1.0
# Heights that differ by less are one [m].
_SAME_HEIGHT = 1e-6
# Distances are kept up to so many cells off the border, outside the cutter.
_BAND = 3.0
# Number of what no move has removed.
RAW = -1


@dataclass(frozen=True)
class RawStock:
    """Raw stock: all below a height, or a block with sides along the part's axes.

    Attributes:
        surface: Height of its top in the part [m].
        low, high: Corners of the block in the part's x-y plane [m], (2,); None: it has no sides.
    """

    surface: float
    low: np.ndarray | None = None
    high: np.ndarray | None = None

    def distance(self, points: np.ndarray, widest: float) -> np.ndarray:
        """Return the distances of points from its sides, positive inside, up to a largest one [m].

        Args:
            points: Points in the part's x-y plane [m], (..., 2).
            widest: Largest distance that counts [m].
        """
        if self.low is None or self.high is None:
            return np.full(points.shape[:-1], widest)
        outside = np.maximum(self.low - points, points - self.high)
        away = np.linalg.norm(np.maximum(outside, 0.0), axis=-1)
        inside = -np.minimum(outside.max(axis=-1), 0.0)
        distance: np.ndarray = np.clip(np.where(away > 0.0, -away, inside), -widest, widest)
        return distance


class Stock:
    """Material that is left while a flat end mill goes its way, its axis along z.

    Args:
        raw: The raw stock.
        tips: Places of the tip where it may cut [m], (n, 3).
        radius: Radius of the cutter [m].
        cell: Side of a cell [m]; None: a 40th of the radius, or more where the part is large.

    Attributes:
        cell: Side of a cell [m].
        borders: Heights between which the layers lie, rising [m], (layers + 1,).
        middles: Heights of their middles, which a tip that takes them away has reached [m], (layers,).
    """

    def __init__(
        self, raw: RawStock, tips: np.ndarray, radius: float, cell: float | None = None
    ) -> None:
        self._radius = radius
        self.borders = _borders(tips, raw.surface, radius)
        self.middles = 0.5 * (self.borders[1:] + self.borders[:-1])
        layers = len(self.middles)
        low, high = tips[:, :2].min(axis=0), tips[:, :2].max(axis=0)
        if cell is None:
            area = float(np.prod(high - low + 2.2 * radius))
            cell = max(radius / _PER_RADIUS, float(np.sqrt(area * layers / _MOST_CELLS)))
        self.cell = cell
        self._low = low - radius - 2.0 * _BAND * cell
        size = np.ceil((high + radius + 2.0 * _BAND * cell - self._low) / cell).astype(int) + 1
        self._x, self._y = (self._low[axis] + cell * np.arange(size[axis]) for axis in range(2))
        middle = np.stack(np.meshgrid(self._x, self._y), axis=-1)
        layer = raw.distance(middle, radius).astype(np.float32)
        self._distance = np.repeat(layer[None], layers, axis=0)
        self._remover = np.full(self._distance.shape, RAW, dtype=np.int32)

    def remove(self, begin: np.ndarray, end: np.ndarray, number: int) -> None:
        """Take away what the cutter sweeps as its tip goes straight.

        Args:
            begin, end: Both ends of the way of the tip [m], (3,).
            number: Number of the move, which is remembered where it has made a surface.
        """
        first = int(np.searchsorted(self.middles, 0.5 * (begin[2] + end[2]) - _SAME_HEIGHT))
        if first == len(self.middles):
            return
        reach = self._radius + _BAND * self.cell
        columns, rows = (
            _within(axis, min(a, b) - reach, max(a, b) + reach)
            for axis, a, b in zip((self._x, self._y), begin[:2], end[:2], strict=True)
        )
        x, y = self._x[columns], self._y[rows][:, None]
        way = end[:2] - begin[:2]
        square = float(way @ way)
        along = (x - begin[0]) * way[0] + (y - begin[1]) * way[1]
        share = np.clip(along / square, 0.0, 1.0) if square > 0.0 else np.zeros_like(along)
        away = np.hypot(x - begin[0] - share * way[0], y - begin[1] - share * way[1])
        swept = (away - self._radius).astype(np.float32)
        there = self._distance[first:, rows, columns]
        lower = swept < there
        np.copyto(there, swept, where=lower)
        np.copyto(self._remover[first:, rows, columns], number, where=lower)

    def bottom_layer(self, height: float) -> int:
        """Return the number of the layer that a tip is in by its height; of layers: it is above all."""
        return int(np.searchsorted(self.borders[1:], height + _SAME_HEIGHT, side="right"))

    def material(self, points: np.ndarray, lowest: int) -> np.ndarray:
        """Return distances from the border of the material [m], (layers, n), from a layer upwards.

        Args:
            points: Points in the part's x-y plane, on the raster [m], (n, 2).
            lowest: Number of the layer.
        """
        place = (points - self._low) / self.cell
        corner = np.clip(place.astype(int), 0, [len(self._x) - 2, len(self._y) - 2])
        u, v = (place - corner).T
        column, row = corner.T
        layers = self._distance[lowest:]
        value: np.ndarray = (1.0 - v) * (
            (1.0 - u) * layers[:, row, column] + u * layers[:, row, column + 1]
        ) + v * ((1.0 - u) * layers[:, row + 1, column] + u * layers[:, row + 1, column + 1])
        return value

    def remover(self, point: np.ndarray, layer: int) -> int:
        """Return the number of the move that made the surface next to a point (2,), or RAW."""
        if layer >= len(self._remover):
            return RAW
        column, row = np.round((point - self._low) / self.cell).astype(int)
        return int(self._remover[layer, row, column])

    def volume(self) -> float:
        """Return the volume of the material on the raster [m^3]."""
        share = np.clip(self._distance / self.cell + 0.5, 0.0, 1.0)
        by_layer = share.sum(axis=(1, 2), dtype=float)
        return float(by_layer @ np.diff(self.borders)) * self.cell**2


def _within(axis: np.ndarray, low: float, high: float) -> slice:
    return slice(int(np.searchsorted(axis, low)), int(np.searchsorted(axis, high)))


def _borders(tips: np.ndarray, surface: float, radius: float) -> np.ndarray:
    """Return the borders of layers: where floors lie, and between them so that none is thick."""
    inside = np.minimum(tips[:, 2], surface)
    level = np.abs(np.diff(inside)) < _SAME_HEIGHT
    floors = _apart([surface, float(inside.min()), *inside[1:][level].tolist()])
    thickest = min(radius / _LAYERS_PER_RADIUS, _descent_by_pass(tips, radius) / _PER_PASS)
    thickest = max(thickest, (floors[-1] - floors[0]) / _MOST_LAYERS)
    if len(floors) > _MOST_LAYERS:
        return np.linspace(floors[0], floors[-1], _MOST_LAYERS + 1)
    pieces = [
        np.linspace(low, high, int(np.ceil((high - low) / thickest - 1e-9)) + 1)[:-1]
        for low, high in pairwise(floors)
    ]
    return np.append(np.concatenate([*pieces, np.zeros(0)]), floors[-1])


def _descent_by_pass(tips: np.ndarray, radius: float) -> float:
    """Return how far a tip goes down from one pass over a place to the next, in the median [m].

    Infinite where it does so nowhere: a helix passes over itself, a straight ramp does not.
    """
    down = np.flatnonzero(np.diff(tips[:, 2]) < -_SAME_HEIGHT / _LAYERS_PER_RADIUS)
    way = arc_length(tips[:, :2])[down]
    places = tips[down]
    lower = []
    near = cKDTree(places[:, :2]).query_ball_point(places[:, :2], _NEAR * radius)
    for row, others in enumerate(near):
        before = np.array(others)[way[others] < way[row] - _ANOTHER * radius]
        higher = places[before, 2] - places[row, 2]
        higher = higher[higher > _SAME_HEIGHT]
        if len(higher):
            lower.append(float(higher.min()))
    return float(np.median(lower)) if lower else np.inf


def _apart(heights: Sequence[float]) -> list[float]:
    """Return heights that differ, rising; the first given is the last."""
    rising: list[float] = []
    for height in sorted(set(heights)):
        if not rising or height - rising[-1] > _SAME_HEIGHT:
            rising.append(height)
    return rising
