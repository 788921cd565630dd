"""Heights of the floor that an end mill leaves, and how much of its end stands on material."""

from __future__ import annotations

import numpy as np

from coupling.process.stock import RawStock

# Cells in a radius of the cutter, and cells at most.
_PER_RADIUS, _MOST_CELLS = 20, 4_000_000
# Material that is thinner than this is none [m].
_THINNEST = 1e-9


class Floor:
    """Floor under a flat end mill that goes its way, its axis along z.

    Args:
        raw: The raw stock.
        tips: Places of the tip where it may cut [m], (n, 3).
        radius: Radius of the cutter [m].
    """

    def __init__(self, raw: RawStock, tips: np.ndarray, radius: float) -> None:
        self._radius = radius
        low, high = tips[:, :2].min(axis=0) - radius, tips[:, :2].max(axis=0) + radius
        cell = max(radius / _PER_RADIUS, float(np.sqrt(np.prod(high - low) / _MOST_CELLS)))
        self._low, self._cell = low - cell, cell
        self._x, self._y = (
            np.arange(a, b + 3.0 * cell, cell) for a, b in zip(self._low, high, strict=True)
        )
        middle = np.stack(np.meshgrid(self._x, self._y), axis=-1)
        is_stock = raw.distance(middle, radius) > 0.0
        self._height = np.where(is_stock, raw.surface, -np.inf)

    def height(self, points: np.ndarray) -> np.ndarray:
        """Return its heights next to points in the part's x-y plane [m], (n, 2): [m], (n,)."""
        column, row = np.round((points - self._low) / self._cell).astype(int).T
        height: np.ndarray = self._height[row, column]
        return height

    def cut(self, begin: np.ndarray, end: np.ndarray) -> float:
        """Lower the floor as the tip goes a short way straight, a small part of its radius.

        Args:
            begin, end: Both ends of the way of the tip [m], (3,).

        Returns:
            Share of the area of the cutter's end under which material is taken [1].
        """
        x, y = (
            slice(*np.searchsorted(axis, [place - self._radius, place + self._radius]))
            for axis, place in zip((self._x, self._y), end[:2], strict=True)
        )
        height = self._height[y, x]
        away = np.hypot(self._x[x] - end[0], self._y[y][:, None] - end[1])
        is_under = away <= self._radius
        is_cut = is_under & (height > end[2] + _THINNEST)
        share = float(is_cut.sum() / is_under.sum()) if is_under.any() else 0.0
        height[is_cut] = end[2]
        return share if end[2] < begin[2] else 0.0
