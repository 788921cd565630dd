"""Small elements summed up, coarse element by coarse element."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from coupling.sheet_fem.compiled import compiled, inlined
from coupling.sheet_fem.contact import Surface
from coupling.sheet_fem.on_stack import on_stack
from coupling.sheet_fem.plate import add_plate
from coupling.sheet_fem.shell import Point, Shell, add_response, integrate, sum_up


class MacroElements(NamedTuple):
    """Forces and stiffness of elements by coarse element, each from a state of its own.

    Attributes:
        force: Forces on the nine coarse splines [N], (cells, 27).
        stiffness: Their derivative [N/m], (cells, 27, 27).
        since: Moves of the splines from the state that a cell was evaluated in [m], (cells, 9, 3).
    """

    force: np.ndarray
    stiffness: np.ndarray
    since: np.ndarray

    @classmethod
    def none(cls, count: int) -> MacroElements:
        """Return cells without elements."""
        return cls(np.zeros((count, 27)), np.zeros((count, 27, 27)), np.zeros((count, 9, 3)))

    def only(self, kept: np.ndarray) -> MacroElements:
        """Return them with all but those of a mask (cells,) empty."""
        some = self.none(len(kept))
        for new, old in zip(some, self, strict=True):
            new[kept] = old[kept]
        return some

    def after(self, moves: np.ndarray) -> MacroElements:
        """Return them after moves of the splines [m], (cells, 9, 3), as far as they are linear."""
        force = self.force + np.einsum("eij,ej->ei", self.stiffness, moves.reshape(-1, 27))
        return MacroElements(force, self.stiffness, self.since + moves)

    def bent(self) -> np.ndarray:
        """Return the bending of each cell since its evaluation [m], (cells,)."""
        apart = np.empty(len(self.since))
        _spread(self.since, apart)
        return apart


@compiled
def _spread(since: np.ndarray, apart: np.ndarray) -> None:
    for cell in range(len(since)):
        apart[cell] = 0.0
        for k in range(3):
            least = most = since[cell, 0, k]
            for A in range(1, 9):
                least, most = min(least, since[cell, A, k]), max(most, since[cell, A, k])
            apart[cell] = max(apart[cell], most - least)


@compiled
def fill_cells(
    shell: Shell,
    surface: Surface,
    blend: np.ndarray,
    outside: np.ndarray,
    places: np.ndarray,
    points: np.ndarray,
    plastic: np.ndarray,
    force: np.ndarray,
    stiffness: np.ndarray,
    new_plastic: np.ndarray,
    new_stretch: np.ndarray,
) -> None:
    """Compute what the elements of some cells do, and the plate under them.

    Args:
        shell: Data that all elements share.
        surface: Contact points and plate.
        blend: Weights of `CoarseSplines`, (factor, factor, 9, 9).
        outside: Mask of the elements that count, (nx, ny).
        places: Numbers of the cells in x and y, (e, 2).
        points: Control points [m], (nx + 2, ny + 2, 3).
        plastic: Plastic strains before [1], (nx, ny, points, layers, 4).
        force: Written: forces of all cells, as of `MacroElements` [N], (cells, 27).
        stiffness: Written: their derivative [N/m], (cells, 27, 27).
        new_plastic: Written: plastic strains after, shape of `plastic` [1].
        new_stretch: Written: stretch of the thickness [1], (nx, ny, points).
    """
    factor, count = blend.shape[0], shell.basis.area.shape[0]
    columns = outside.shape[1] // factor
    functions = np.empty((factor**2 * count * 5, 9))
    responses = np.empty((factor**2 * count * 5, 6, 9))
    on_plate, held = on_stack((27,)), np.empty((27, 27))
    nodes = on_stack((9, 3))
    point = Point(
        on_stack((2, 3)),
        on_stack((2, 3)),
        on_stack((3,)),
        on_stack((3,)),
        on_stack((5, 9)),
        on_stack((6,)),
        on_stack((6, 6)),
    )
    for e in range(len(places)):
        cell = places[e, 0] * columns + places[e, 1]
        force[cell] = 0.0
        rows = 0
        for s in range(factor):
            for t in range(factor):
                i, j = places[e, 0] * factor + s, places[e, 1] * factor + t
                if not outside[i, j]:
                    continue
                for A in range(9):
                    nodes[A] = points[i + A // 3, j + A % 3]
                history = plastic[i, j], new_plastic[i, j], new_stretch[i, j]
                for g in range(count):
                    integrate(shell, g, nodes, *history, point)
                    own = functions[rows : rows + 5]
                    _summed(blend[s, t], point.functions, own)
                    add_response(point, own, force[cell], responses[rows : rows + 5])
                    rows += 5
        sum_up(functions[:rows], responses[:rows], stiffness[cell])
        if np.isinf(surface.plane):
            continue
        for s in range(factor):
            for t in range(factor):
                i, j = places[e, 0] * factor + s, places[e, 1] * factor + t
                if not outside[i, j]:
                    continue
                on_plate[:], held[:] = 0.0, 0.0
                if add_plate(surface, i, j, points, on_plate, held):
                    _coarsen(blend[s, t], on_plate, held, force[cell], stiffness[cell])


@inlined
def _summed(M: np.ndarray, functions: np.ndarray, summed: np.ndarray) -> None:
    """Write the functions of the coarse splines, (5, 9), that the nine of an element sum up to."""
    summed[:, :] = 0.0
    for i in range(5):
        for A in range(9):
            for C in range(9):
                summed[i, C] += functions[i, A] * M[A, C]


@compiled
def _coarsen(
    M: np.ndarray,
    force: np.ndarray,
    stiffness: np.ndarray,
    summed: np.ndarray,
    tangent: np.ndarray,
) -> None:
    """Add forces and stiffness of an element to those of the coarse one in which it lies."""
    summed += np.dot(M.T, force.reshape(9, 3)).reshape(27)
    half = np.dot(M.T, stiffness.reshape(9, 81)).reshape(27, 27)
    # The stiffness is symmetric: its columns are summed up as its rows are.
    tangent += np.dot(M.T, half.T.copy().reshape(9, 81)).reshape(27, 27)
