"""The interface of a box: the coarse unknowns outside of it that its elements see."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np

from coupling.sheet_fem.box import Box
from coupling.sheet_fem.coarse import CoarseSplines
from coupling.sheet_fem.edge_elements import EdgeElements

# Singular values of the splines' weights in the edge, over the largest, below which these are free.
_HARDLY_SEEN = 1e-3


@dataclass(frozen=True)
class Interface:
    """Coarse unknowns outside of a box, and how its elements see them.

    Attributes:
        splines: The coarse splines.
        box: Control points of the box.
        outside: Mask of the fine control points that are not in the box, (nx + 2, ny + 2).
        outer: Numbers of the interface's unknowns, -1 for others, (coarse nx + 2, coarse ny + 2, 3).
        inner: Numbers of those that follow, likewise, (coarse nx + 2, coarse ny + 2, 3).
    """

    splines: CoarseSplines
    box: Box
    outside: np.ndarray
    outer: np.ndarray
    inner: np.ndarray

    @classmethod
    def of(cls, splines: CoarseSplines, box: Box, free: np.ndarray) -> Interface:
        """Return the interface of a box.

        Args:
            splines: Coarse splines; one that reaches a control point that is held is held itself.
            box: Control points of the box.
            free: Mask of fine control points that may move, (nx + 2, ny + 2, 3).
        """
        inside = box.inside(free.shape)
        visible_box = box.grown(2, free.shape).inside(free.shape)
        moves = ~splines.touching(~free) & splines.touching(~inside)[..., None]
        outer = moves & splines.touching(visible_box & ~inside)[..., None]
        return cls(
            splines,
            box,
            ~inside,
            _number_unknowns(outer),
            np.where(outer, -1, _everything(outer, moves)),
        )

    @cached_property
    def size(self) -> int:
        """Number of the interface's unknowns."""
        return int(self.outer.max()) + 1

    @cached_property
    def edge(self) -> tuple[np.ndarray, np.ndarray]:
        """Numbers in x and y of the control points outside that the box's elements see, (p,) each."""
        x, y = np.nonzero(
            self.box.grown(2, self.outside.shape).inside(self.outside.shape) & self.outside
        )
        return x, y

    @cached_property
    def _edge_weights(self) -> np.ndarray:
        """Weights of the interface's splines in those, (p, splines)."""
        (x, y), (columns, rows) = self.edge, self._splines
        weights: np.ndarray = self.splines.along_x[x][:, columns] * self.splines.along_y[y][:, rows]
        return weights

    @cached_property
    def _splines(self) -> tuple[np.ndarray, np.ndarray]:
        """Places of the splines that the interface's unknowns move, (splines,) each."""
        x, y = np.nonzero((self.outer >= 0).any(axis=-1))
        return x, y

    def at_edge(self, at_interface: np.ndarray) -> np.ndarray:
        """Return the moves of the edge's control points for the interface's unknowns [m], (p, 3)."""
        numbers = self.outer[self._splines]
        coarse = np.where(numbers >= 0, at_interface[numbers], 0.0)
        moves: np.ndarray = self._edge_weights @ coarse
        return moves

    def fitted(self, moves: np.ndarray) -> np.ndarray:
        """Return the interface's unknowns [m], (m,), for which its edge moves nearly so [m], (p, 3)."""
        numbers = self.outer[self._splines]
        coarse = np.linalg.lstsq(self._edge_weights, moves, rcond=_HARDLY_SEEN)[0]
        at_interface = np.zeros(self.size)
        at_interface[numbers[numbers >= 0]] = coarse[numbers >= 0]
        return at_interface

    def of_cells(self, numbers: np.ndarray) -> np.ndarray:
        """Return the numbers of the unknowns of all coarse elements, (cells, 27)."""
        return numbers.reshape(-1, 3)[self.splines.patches].reshape(-1, 27)

    @cached_property
    def edge_elements(self) -> EdgeElements:
        """The elements of the box that see the edge."""
        box, factor = self.box, self.splines.factor
        places = box.elements(self.outside.shape)
        nine = np.arange(9)
        x, y = places[:, :1] + nine // 3, places[:, 1:] + nine % 3
        away = self.outside[x, y]
        numbers = np.flatnonzero(away.any(axis=1))
        at = places[numbers]
        blend = self.splines.blend[at[:, 0] % factor, at[:, 1] % factor]
        x, y = at[:, :1] // factor + nine // 3, at[:, 1:] // factor + nine % 3
        unknowns = self.outer[x, y].reshape(len(at), 27)
        return EdgeElements(numbers, np.where(away[numbers][:, :, None], blend, 0.0), unknowns)


def _number_unknowns(mask: np.ndarray) -> np.ndarray:
    numbers = np.full(mask.shape, -1, dtype=np.int64)
    numbers[mask] = np.arange(np.count_nonzero(mask))
    return numbers


def _everything(outer: np.ndarray, moves: np.ndarray) -> np.ndarray:
    """Number the inner unknowns by their place, so that their matrix is a band."""
    return np.where(moves & ~outer, np.arange(outer.size).reshape(outer.shape), -1)
