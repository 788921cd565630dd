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

import numpy as np

from coupling.sheet_fem.banded import Cholesky, SymmetricBanded
from coupling.sheet_fem.border import add_border
from coupling.sheet_fem.interface import Interface
from coupling.sheet_fem.macro_elements import MacroElements


@dataclass(frozen=True)
class CondensedFarField:
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

    rim: Interface
    points: np.ndarray
    cells: MacroElements
    whole: np.ndarray
    force: np.ndarray
    stiffness: np.ndarray
    factor: Cholesky
    half: np.ndarray

    @classmethod
    def of(
        cls, rim: Interface, points: np.ndarray, cells: MacroElements, whole: np.ndarray
    ) -> CondensedFarField:
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

    def cells_at(self, at_rim: np.ndarray) -> MacroElements:
        """Return the elements, as far as they are linear, where the rim's unknowns [m] carry them."""
        return self.cells.after(self._moves(at_rim))

    def bent_at(self, at_rim: np.ndarray) -> np.ndarray:
        """Return how far the rim's unknowns [m] bend each cell since its evaluation [m], (cells,)."""
        since = self.cells.since + self._moves(at_rim)
        return self.cells._replace(since=since).bent()

    def _moves(self, at_rim: np.ndarray) -> np.ndarray:
        """Return the moves of the splines of each cell for those of the rim [m], (cells, 9, 3)."""
        moves: np.ndarray = self.moved(at_rim).reshape(-1, 3)[self.rim.splines.patches]
        return moves

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

    def carry_edge(self, at_rim: np.ndarray, points: np.ndarray) -> None:
        """Set those of them that the box's elements see: only the rim's unknowns move these."""
        x, y = self.rim.edge
        points[x, y] = self.points[x, y] + self.rim.at_edge(at_rim)
