"""Small elements summed up, coarse element by coarse element."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from coupling.sheet_fem.compiled import compile_function, internal
from coupling.sheet_fem.contact import Surface
from coupling.sheet_fem.element import fill_elements
from coupling.sheet_fem.shell import Shell


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

    def only(self, mask: np.ndarray) -> MacroElements:
        """Return them with all but those of a mask (cells,) empty."""
        some = self.none(len(mask))
        for new, old in zip(some, self, strict=True):
            new[mask] = old[mask]
        return some

    def after(self, moves: np.ndarray) -> MacroElements:
        """Return them after moves of the splines [m], (cells, 9, 3), as far as they are linear."""
        force = self.force + np.einsum("eij,ej->ei", self.stiffness, moves.reshape(-1, 27))
        return MacroElements(force, self.stiffness, self.since + moves)

    def bent(self) -> np.ndarray:
        """Return the bending of each cell since its evaluation [m], (cells,)."""
        bent: np.ndarray = np.ptp(self.since, axis=1).max(axis=-1)
        return bent


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
    factor, columns = len(blend), outside.shape[1] // len(blend)
    elements = factor * places[:, None] + np.argwhere(np.ones((factor, factor)))
    elements = elements[outside[elements[..., 0], elements[..., 1]]]
    acting = np.empty((len(elements), 27)), np.empty((len(elements), 27, 27))
    fill_elements(shell, surface, elements, points, plastic, *acting, new_plastic, new_stretch)
    cells = places[:, 0] * columns + places[:, 1]
    force[cells], stiffness[cells] = 0.0, 0.0
    _add_elements(blend, columns, elements, *acting, force, stiffness)


@compile_function
def _add_elements(
    blend: np.ndarray,
    columns: int,
    places: np.ndarray,
    force: np.ndarray,
    stiffness: np.ndarray,
    on_cells: np.ndarray,
    of_cells: np.ndarray,
) -> None:
    """Add forces (e, 27) and stiffness (e, 27, 27) of elements at `places` to those of their cells."""
    factor = blend.shape[0]
    for e in range(len(places)):
        i, j = places[e, 0], places[e, 1]
        cell = i // factor * columns + j // factor
        M = blend[i % factor, j % factor]
        _coarsen(M, force[e], stiffness[e], on_cells[cell], of_cells[cell])


@internal
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
