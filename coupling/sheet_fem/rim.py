"""The rim of a box: the coarse unknowns outside of it that its elements see."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np

from coupling.sheet_fem.box import Box
from coupling.sheet_fem.coarse import CoarseSplines
from coupling.sheet_fem.compiled import compiled

# Singular values of the splines' weights in the edge, over the largest, that tell nothing of them.
_HARDLY_SEEN = 1e-3


@dataclass(frozen=True)
class Rim:
    """Which coarse unknowns there are outside of a box, and how its elements see them.

    Attributes:
        splines: The coarse splines.
        box: Control points of the box.
        outside: Mask of the fine control points that are not in the box, (nx + 2, ny + 2).
        outer: Numbers of the rim's unknowns, -1 for others, (coarse nx + 2, coarse ny + 2, 3).
        inner: The same of those that follow.
    """

    splines: CoarseSplines
    box: Box
    outside: np.ndarray
    outer: np.ndarray
    inner: np.ndarray

    @classmethod
    def of(cls, splines: CoarseSplines, box: Box, free: np.ndarray) -> Rim:
        """Return the rim of a box.

        Args:
            splines: Coarse splines; one that reaches a control point that is held is held itself.
            box: Control points of the box.
            free: Which fine control points may move, (nx + 2, ny + 2, 3).
        """
        inside = box.inside(free.shape)
        seen = box.grown(2, free.shape).inside(free.shape)
        moves = ~splines.touching(~free) & splines.touching(~inside)[..., None]
        outer = moves & splines.touching(seen & ~inside)[..., None]
        return cls(
            splines, box, ~inside, _numbered(outer), np.where(outer, -1, _everything(outer, moves))
        )

    @cached_property
    def size(self) -> int:
        """Number of the rim's unknowns."""
        return int(self.outer.max()) + 1

    @cached_property
    def edge(self) -> tuple[np.ndarray, np.ndarray]:
        """Places of the control points outside of the box that its elements see, (p,) each."""
        x, y = np.nonzero(
            self.box.grown(2, self.outside.shape).inside(self.outside.shape) & self.outside
        )
        return x, y

    @cached_property
    def _edge_weights(self) -> np.ndarray:
        """Weights of the rim's splines in those, (p, splines)."""
        (x, y), (columns, rows) = self.edge, self._splines
        weights: np.ndarray = self.splines.along_x[x][:, columns] * self.splines.along_y[y][:, rows]
        return weights

    @cached_property
    def _splines(self) -> tuple[np.ndarray, np.ndarray]:
        """Places of the splines that the rim's unknowns move, (splines,) each."""
        x, y = np.nonzero((self.outer >= 0).any(axis=-1))
        return x, y

    def at_edge(self, at_rim: np.ndarray) -> np.ndarray:
        """Return the moves of the edge's control points for the rim's unknowns [m], (p, 3)."""
        numbers = self.outer[self._splines]
        coarse = np.where(numbers >= 0, at_rim[numbers], 0.0)
        moves: np.ndarray = self._edge_weights @ coarse
        return moves

    def fitted(self, moves: np.ndarray) -> np.ndarray:
        """Return the rim's unknowns [m], (m,), for which its edge moves nearly so [m], (p, 3)."""
        numbers = self.outer[self._splines]
        coarse = np.linalg.lstsq(self._edge_weights, moves, rcond=_HARDLY_SEEN)[0]
        at_rim = np.zeros(self.size)
        at_rim[numbers[numbers >= 0]] = coarse[numbers >= 0]
        return at_rim

    def of_cells(self, numbers: np.ndarray) -> np.ndarray:
        """Return the numbers of the unknowns of all coarse elements, (cells, 27)."""
        return numbers.reshape(-1, 3)[self.splines.patches].reshape(-1, 27)

    def at(self, numbers: np.ndarray, places: np.ndarray) -> np.ndarray:
        """Return the numbers of the unknowns of the coarse elements at places, (places, 27)."""
        x = places[:, 0, None] + np.repeat(np.arange(3), 3)
        y = places[:, 1, None] + np.tile(np.arange(3), 3)
        return numbers[x, y].reshape(len(places), 27)


def _numbered(mask: np.ndarray) -> np.ndarray:
    numbers = np.full(mask.shape, -1, dtype=np.int64)
    numbers[mask] = np.arange(np.count_nonzero(mask))
    return numbers


def _everything(outer: np.ndarray, moves: np.ndarray) -> np.ndarray:
    """Number the inner unknowns by their place, so that their matrix is a band."""
    return np.where(moves & ~outer, np.arange(outer.size).reshape(outer.shape), -1)


@compiled
def see_rim(
    places: np.ndarray,
    box: Box,
    blend: np.ndarray,
    force: np.ndarray,
    stiffness: np.ndarray,
    at_rim: np.ndarray,
    across: np.ndarray,
    among: np.ndarray,
) -> None:
    """Fill in what elements at a box are to the coarse unknowns that move their points outside of it.

    Args:
        places: Elements, (e, 2).
        box: Control points of the box.
        blend: As of the splines.
        force: Nodal forces [N], (e, 27).
        stiffness: Their derivative, symmetric, (e, 27, 27).
        at_rim: Written: forces on the nine coarse splines, (e, 27).
        across: Written: derivative of these forces by the nodes, (e, 27, 27).
        among: Written: derivative of their forces by them, (e, 27, 27).
    """
    factor = blend.shape[0]
    M, turned = np.empty((9, 9)), np.empty((27, 27))
    for e in range(len(places)):
        i, j = places[e, 0], places[e, 1]
        at_rim[e] = 0.0
        across[e] = 0.0
        among[e] = 0.0
        for A in range(9):
            x, y = i + A // 3, j + A % 3
            inside = box.first_x <= x < box.last_x and box.first_y <= y < box.last_y
            for C in range(9):
                M[A, C] = 0.0 if inside else blend[i % factor, j % factor, A, C]
        # Most weights are zero: a box's edge takes one or two rows of an element's points.
        for A in range(9):
            for C in range(9):
                weight = M[A, C]
                if weight == 0.0:
                    continue
                for k in range(3):
                    at_rim[e, 3 * C + k] += weight * force[e, 3 * A + k]
                    for r in range(27):
                        across[e, 3 * C + k, r] += weight * stiffness[e, 3 * A + k, r]
        turned[:, :] = across[e].T
        for A in range(9):
            for C in range(9):
                weight = M[A, C]
                if weight == 0.0:
                    continue
                for k in range(3):
                    for r in range(27):
                        among[e, 3 * C + k, r] += weight * turned[3 * A + k, r]
