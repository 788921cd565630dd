"""Coarse splines over the fine ones: how the sheet moves away from the tools.

A quadratic B-spline on elements that are f times as large is a sum of fine ones, with the weights of
(1 + z + ... + z^(f-1))^3 / f^2 in each direction.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from math import gcd

import numpy as np

# Fine elements in a coarse one, in each direction, where the grid can be cut so.
COARSENING = 4


@dataclass(frozen=True)
class CoarseSplines:
    """Splines on coarse elements, each of which covers `factor` x `factor` fine ones.

    Attributes:
        factor: Fine elements in a coarse one, in each direction.
        along_x: Weights of the fine splines in the coarse ones, (nx + 2, coarse nx + 2).
        along_y: Such weights in y, (ny + 2, coarse ny + 2).
        blend: Weights of an element's nine fine splines in the nine coarse ones there, by the
            element's place in its coarse element, (factor, factor, 9, 9).
    """

    factor: int
    along_x: np.ndarray
    along_y: np.ndarray
    blend: np.ndarray

    @classmethod
    def of(cls, elements: tuple[int, int]) -> CoarseSplines:
        """Return those of a fine grid, as coarse as COARSENING if that divides both its numbers.

        Example:
            >>> CoarseSplines.of((8, 12)).along_x.shape
            (10, 4)
        """
        factor = gcd(COARSENING, *elements)
        single = refinement(3, factor)
        weights = np.stack(
            [single[2 * factor + s : 2 * factor + s + 3, 2:5] for s in range(factor)]
        )
        blend = np.einsum("sac,tbd->stabcd", weights, weights).reshape(factor, factor, 9, 9)
        along_x, along_y = (refinement(count // factor, factor) for count in elements)
        return cls(factor, along_x, along_y, np.ascontiguousarray(blend))

    @property
    def elements(self) -> tuple[int, int]:
        """Numbers of coarse elements in x and y."""
        return self.along_x.shape[1] - 2, self.along_y.shape[1] - 2

    @cached_property
    def patches(self) -> np.ndarray:
        """Numbers of the nine coarse splines of every coarse element, (cells, 9)."""
        nx, ny = self.elements
        x = np.repeat(np.arange(nx), ny)[:, None] + np.repeat(np.arange(3), 3)
        y = np.tile(np.arange(ny), nx)[:, None] + np.tile(np.arange(3), 3)
        return x * (ny + 2) + y

    def touching(self, fine: np.ndarray) -> np.ndarray:
        """Return the mask of coarse splines that have a part in any of some fine ones.

        Args:
            fine: Mask, (nx + 2, ny + 2) or (nx + 2, ny + 2, 3).
        """
        weights = np.tensordot(self.along_x.T, fine.astype(float), axes=1)
        weights = np.moveaxis(np.tensordot(self.along_y.T, weights, axes=(1, 1)), 0, 1)
        touched: np.ndarray = weights > 0.0
        return touched

    def fine(self, coarse: np.ndarray) -> np.ndarray:
        """Return the moves of fine control points [m], (nx + 2, ny + 2, 3), for those of coarse ones."""
        along = self.along_x @ coarse.reshape(len(coarse), -1)
        moves: np.ndarray = self.along_y @ along.reshape(len(along), -1, 3)
        return moves


def refinement(count: int, factor: int) -> np.ndarray:
    """Return the weights of fine splines in coarse ones in one direction.

    Args:
        count: Number of coarse elements.
        factor: Fine elements in each.

    Returns:
        (factor * count + 2, count + 2); rows of fine splines that are whole on the grid sum to one.

    Example:
        >>> refinement(2, 2)[2:4, 1:3]
        array([[0.75, 0.25],
               [0.25, 0.75]])
    """
    box = np.ones(factor)
    weights = np.convolve(np.convolve(box, box), box) / factor**2
    table = np.zeros((factor * count + 2, count + 2))
    for column in range(count + 2):
        first = factor * (column - 2) + 2
        rows = np.arange(first, first + len(weights))
        inside = (rows >= 0) & (rows < len(table))
        table[rows[inside], column] = weights[inside]
    return table
