"""The control points about the tools whose equilibrium is solved for."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np


class Box(NamedTuple):
    """Control points [first, last) in x and y whose equilibrium is solved for."""

    first_x: int
    last_x: int
    first_y: int
    last_y: int

    @classmethod
    def over(cls, boxes: list[Box]) -> Box:
        """Return the smallest box over others."""
        first_x, last_x, first_y, last_y = zip(*boxes, strict=True)
        return cls(min(first_x), max(last_x), min(first_y), max(last_y))

    def contains(self, other: Box) -> bool:
        """Return whether another box lies in it."""
        return (
            self.first_x <= other.first_x
            and other.last_x <= self.last_x
            and self.first_y <= other.first_y
            and other.last_y <= self.last_y
        )

    @property
    def size(self) -> int:
        """Number of its control points."""
        return (self.last_x - self.first_x) * (self.last_y - self.first_y)

    @property
    def ranges(self) -> tuple[np.ndarray, np.ndarray]:
        """Numbers of its control points in x and y, (width,) each."""
        return np.arange(self.first_x, self.last_x), np.arange(self.first_y, self.last_y)

    def inside(self, shape: tuple[int, ...]) -> np.ndarray:
        """Return the mask of its control points, (nx + 2, ny + 2)."""
        mask = np.zeros(shape[:2], dtype=bool)
        mask[self.first_x : self.last_x, self.first_y : self.last_y] = True
        return mask

    def elements(self, shape: tuple[int, ...]) -> np.ndarray:
        """Return the places (i, j) of the elements that its control points shape, (n, 2).

        Args:
            shape: Numbers of all control points in x and y.
        """
        x = np.arange(max(self.first_x - 2, 0), min(self.last_x, shape[0] - 2))
        y = np.arange(max(self.first_y - 2, 0), min(self.last_y, shape[1] - 2))
        return np.column_stack([np.repeat(x, len(y)), np.tile(y, len(x))])

    def grown(self, by: int, shape: tuple[int, ...]) -> Box:
        """Return it with more rows on all sides, as far as there are any."""
        return Box(
            max(self.first_x - by, 0),
            min(self.last_x + by, shape[0]),
            max(self.first_y - by, 0),
            min(self.last_y + by, shape[1]),
        )
