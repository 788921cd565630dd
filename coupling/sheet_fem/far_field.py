"""The sheet outside of a box: linear, in coarse splines, and condensed onto the interface of the box.

Near the tools every control point of the fine grid is an unknown.  Outside of the box B about them a
move is one of the coarse splines' (hierarchical splines, truncated in B [Giannelli2012]): fine control
points there are x = x0 + P u.  Forces and stiffness of its elements are those at x0, with their own
plastic strains; of the coarse unknowns u those that reach the elements at the box, the interface's r,
stay, the others i follow:

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
    """Forces and stiffness of the sheet outside of a box at the interface's unknowns.

    Attributes:
        interface: The interface's unknowns.
        points: Fine control points where it was made linear [m], (nx + 2, ny + 2, 3).
        cells: The elements outside of the box there.
        whole: Mask of cells without an element that the box shapes, (cells,).
        force: Unbalanced forces at the interface there [N], (m,).
        stiffness: Their derivative by the interface's unknowns [N/m], (m, m).
        factor: Factors of the stiffness of the unknowns that follow.
        half: L^-1 times its matrix by the interface's unknowns, and the forces, (coarse, m + 1).
    """

    interface: Interface
    points: np.ndarray
    cells: MacroElements
    whole: np.ndarray
    force: np.ndarray
    stiffness: np.ndarray
    factor: Cholesky
    half: np.ndarray

    @classmethod
    def of(
        cls, interface: Interface, points: np.ndarray, cells: MacroElements, whole: np.ndarray
    ) -> CondensedFarField:
        """Condense the elements outside of a box onto its interface.

        Args:
            interface: The box's interface.
            points: Fine control points of the state [m], (nx + 2, ny + 2, 3).
            cells: The elements there.
            whole: Mask of cells without an element that the box shapes, (cells,).
        """
        ny = interface.splines.elements[1]
        outer, inner = interface.of_cells(interface.outer), interface.of_cells(interface.inner)
        count, size = interface.outer.size, interface.size
        band = SymmetricBanded.of(inner, cells.stiffness, count, 3 * (2 * (ny + 2) + 2) + 2)
        across, among = np.zeros((count, size)), np.zeros((size, size))
        add_border(inner, outer, cells.stiffness, cells.stiffness, across, among)
        at_inner = np.bincount(inner[inner >= 0], cells.force[inner >= 0], count)
        at_outer = np.bincount(outer[outer >= 0], cells.force[outer >= 0], size)
        factor = band.factor()
        half = factor.forward(np.column_stack([across, at_inner]))
        reduced = half.T @ half
        return cls(
            interface,
            points,
            cells,
            whole,
            at_outer - reduced[:-1, -1],
            among - reduced[:-1, :-1],
            factor,
            half,
        )

    def cells_at(self, at_interface: np.ndarray) -> MacroElements:
        """Return the elements, as linearised, for the interface's unknowns [m], (m,)."""
        return self.cells.after(self._moves(at_interface))

    def bent_at(self, at_interface: np.ndarray) -> np.ndarray:
        """Return the bending of each cell by the interface's unknowns (m,) since its evaluation [m]."""
        since = self.cells.since + self._moves(at_interface)
        return self.cells._replace(since=since).bent()

    def _moves(self, at_interface: np.ndarray) -> np.ndarray:
        """Return the moves of the splines of each cell for those of the interface [m], (cells, 9, 3)."""
        moves: np.ndarray = self.unknowns(at_interface).reshape(-1, 3)[
            self.interface.splines.patches
        ]
        return moves

    def unknowns(self, at_interface: np.ndarray) -> np.ndarray:
        """Return the coarse unknowns for the interface's [m], (coarse nx + 2, coarse ny + 2, 3)."""
        shape = self.interface.outer.shape
        following = self.half @ np.append(-at_interface, -1.0)
        unknowns = self.factor.backward(following[:, None]).reshape(shape)
        unknowns[self.interface.outer >= 0] = at_interface
        return unknowns

    def carry(self, at_interface: np.ndarray, points: np.ndarray) -> None:
        """Set the control points outside of the box for the interface's unknowns [m], (m,)."""
        outside = self.interface.outside
        points[outside] = (self.points + self.interface.splines.fine(self.unknowns(at_interface)))[
            outside
        ]

    def carry_edge(self, at_interface: np.ndarray, points: np.ndarray) -> None:
        """Set those of them that the box's elements see, which the unknowns [m], (m,), move alone."""
        x, y = self.interface.edge
        points[x, y] = self.points[x, y] + self.interface.at_edge(at_interface)
