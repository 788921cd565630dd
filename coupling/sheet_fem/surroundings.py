"""The sheet outside of a box: linear, in coarse splines, and condensed onto the rim of the box.

Near the tools every control point of the fine grid is an unknown.  Outside of the box B about them a
move is one of the coarse splines' (hierarchical splines, truncated in B [Giannelli2012]): fine control
points there are x = x0 + P u.  Forces and stiffness of its elements are those at x0, with their own
plastic strains; of the coarse unknowns u those that reach the elements at the box, the rim's r, stay,
the others i follow:

    u_i = -K_ii^-1 (f_i + K_ir u_r),   f_r + K_rr u_r + K_ri u_i = f + K u_r.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from typing import NamedTuple

import numpy as np

from coupling.sheet_fem.banded import Cholesky, SymmetricBanded
from coupling.sheet_fem.border import add_border
from coupling.sheet_fem.coarse import CoarseSplines
from coupling.sheet_fem.compiled import compiled


class Box(NamedTuple):
    """Control points [first, last) in x and y whose equilibrium is asked for."""

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

    def inside(self, shape: tuple[int, ...]) -> np.ndarray:
        """Return the mask of its control points, (nx + 2, ny + 2)."""
        mask = np.zeros(shape[:2], dtype=bool)
        mask[self.first_x : self.last_x, self.first_y : self.last_y] = True
        return mask

    def grown(self, by: int, shape: tuple[int, ...]) -> Box:
        """Return it with more rows on all sides, as far as there are any."""
        return Box(
            max(self.first_x - by, 0),
            min(self.last_x + by, shape[0]),
            max(self.first_y - by, 0),
            min(self.last_y + by, shape[1]),
        )


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


class Cells(NamedTuple):
    """What elements do, coarse element by coarse element; for each from a state of its own.

    Attributes:
        force: Forces on the nine coarse splines [N], (cells, 27).
        stiffness: Their derivative [N/m], (cells, 27, 27).
        since: Moves of the splines from the state that a cell was evaluated in [m], (cells, 9, 3).
    """

    force: np.ndarray
    stiffness: np.ndarray
    since: np.ndarray

    @classmethod
    def none(cls, count: int) -> Cells:
        """Return cells without elements."""
        return cls(np.zeros((count, 27)), np.zeros((count, 27, 27)), np.zeros((count, 9, 3)))

    def only(self, kept: np.ndarray) -> Cells:
        """Return them with the others empty."""
        some = self.none(len(kept))
        for new, old in zip(some, self, strict=True):
            new[kept] = old[kept]
        return some

    def after(self, moves: np.ndarray) -> Cells:
        """Return them after moves of the splines [m], (cells, 9, 3), as far as they are linear."""
        force = self.force + np.einsum("eij,ej->ei", self.stiffness, moves.reshape(-1, 27))
        return Cells(force, self.stiffness, self.since + moves)

    def bent(self) -> np.ndarray:
        """Return how far the splines of a cell have moved apart since its evaluation [m], (cells,)."""
        apart: np.ndarray = np.ptp(self.since, axis=1).max(axis=1)
        return apart


@dataclass(frozen=True)
class Surroundings:
    """What the sheet outside of a box does, as the rim's unknowns see it.

    Attributes:
        rim: Which unknowns there are.
        points: Fine control points where it was made linear [m], (nx + 2, ny + 2, 3).
        cells: The elements outside of the box there.
        whole: Which cells have no element that the box shapes, (cells,).
        force: Unbalanced forces at the rim there [N], (m,).
        stiffness: Their derivative by the rim's unknowns [N/m], (m, m).
        factor: Factors of the stiffness of the unknowns that follow.
        half: L^-1 of that stiffness' columns at the rim's unknowns, and of the forces, (coarse, m + 1).
    """

    rim: Rim
    points: np.ndarray
    cells: Cells
    whole: np.ndarray
    force: np.ndarray
    stiffness: np.ndarray
    factor: Cholesky
    half: np.ndarray

    @classmethod
    def of(cls, rim: Rim, points: np.ndarray, cells: Cells, whole: np.ndarray) -> Surroundings:
        """Condense the elements outside of a box onto its rim.

        Args:
            rim: The box's rim.
            points: Fine control points of the state [m].
            cells: The elements there.
            whole: Which cells have no element that the box shapes, (cells,).
        """
        ny = rim.splines.elements[1]
        outer, inner = rim.of_cells(rim.outer), rim.of_cells(rim.inner)
        count, size = rim.outer.size, rim.size
        band = SymmetricBanded.of(inner, cells.stiffness, count, 3 * (2 * (ny + 2) + 2) + 2)
        across, among = np.zeros((count, size)), np.zeros((size, size))
        add_border(inner, outer, cells.stiffness, cells.stiffness, across, among)
        at_inner = np.bincount(inner[inner >= 0], cells.force[inner >= 0], count)
        at_outer = np.bincount(outer[outer >= 0], cells.force[outer >= 0], size)
        factor = band.factor()
        half = factor.forward(np.column_stack([across, at_inner]))
        reduced = half.T @ half
        return cls(
            rim,
            points,
            cells,
            whole,
            at_outer - reduced[:-1, -1],
            among - reduced[:-1, :-1],
            factor,
            half,
        )

    def cells_at(self, at_rim: np.ndarray) -> Cells:
        """Return the elements, as far as they are linear, where the rim's unknowns [m] carry them."""
        moved = self.moved(at_rim).reshape(-1, 3)
        return self.cells.after(moved[self.rim.splines.patches])

    def moved(self, at_rim: np.ndarray) -> np.ndarray:
        """Return the coarse unknowns for those of the rim [m], (coarse nx + 2, coarse ny + 2, 3)."""
        shape = self.rim.outer.shape
        following = self.half @ np.append(-at_rim, -1.0)
        unknowns = self.factor.backward(following[:, None]).reshape(shape)
        unknowns[self.rim.outer >= 0] = at_rim
        return unknowns

    def carry(self, at_rim: np.ndarray, points: np.ndarray) -> None:
        """Set the control points outside of the box to where the rim's unknowns [m] carry them."""
        outside = self.rim.outside
        points[outside] = (self.points + self.rim.splines.fine(self.moved(at_rim)))[outside]


@compiled
def coarsen(
    places: np.ndarray,
    blend: np.ndarray,
    columns: int,
    force: np.ndarray,
    stiffness: np.ndarray,
    summed: np.ndarray,
    tangent: np.ndarray,
) -> None:
    """Add forces and stiffness of fine elements to those of the coarse ones in which they lie."""
    factor = blend.shape[0]
    half = np.empty((27, 27))
    for e in range(len(places)):
        i, j = places[e, 0], places[e, 1]
        M = blend[i % factor, j % factor]
        into = (i // factor) * columns + j // factor
        half[:, :] = 0.0
        for A in range(9):
            for C in range(9):
                weight = M[A, C]
                for k in range(3):
                    summed[into, 3 * C + k] += weight * force[e, 3 * A + k]
                    for r in range(27):
                        half[3 * C + k, r] += weight * stiffness[e, 3 * A + k, r]
        for A in range(9):
            for C in range(9):
                weight = M[A, C]
                for r in range(27):
                    for k in range(3):
                        tangent[into, r, 3 * C + k] += weight * half[r, 3 * A + k]


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
        across: Written: derivative of the nodal forces by them, (e, 27, 27).
        among: Written: derivative of their forces by them, (e, 27, 27).
    """
    factor = blend.shape[0]
    M = np.empty((9, 9))
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
        for A in range(9):
            for C in range(9):
                weight = M[A, C]
                if weight == 0.0:
                    continue
                for k in range(3):
                    at_rim[e, 3 * C + k] += weight * force[e, 3 * A + k]
                    for r in range(27):
                        across[e, r, 3 * C + k] += weight * stiffness[e, r, 3 * A + k]
        for A in range(9):
            for C in range(9):
                weight = M[A, C]
                if weight == 0.0:
                    continue
                for k in range(3):
                    for r in range(27):
                        among[e, 3 * C + k, r] += weight * across[e, 3 * A + k, r]
