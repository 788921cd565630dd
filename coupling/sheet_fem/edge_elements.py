"""The elements of a box that see control points outside of it: their forces at the interface."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from coupling.sheet_fem.compiled import compile_function
from coupling.sheet_fem.on_stack import on_stack


class EdgeElements(NamedTuple):
    """Elements at a box's edge, and their motion by coarse splines.

    Attributes:
        numbers: Their numbers among the box's elements, (e,).
        weights: Weights of the nine coarse splines there in their nine control points, as far as those
            are outside of the box, (e, 9, 9).
        unknowns: Numbers of the interface's unknowns that move those splines, -1 for none, (e, 27).
    """

    numbers: np.ndarray
    weights: np.ndarray
    unknowns: np.ndarray


@compile_function
def add_edge(
    edge: EdgeElements,
    inner: np.ndarray,
    force: np.ndarray,
    stiffness: np.ndarray,
    at_interface: np.ndarray,
    across: np.ndarray,
    among: np.ndarray,
) -> None:
    """Add forces and stiffness of the elements at a box's edge to the interface.

    Args:
        edge: These elements; at the edge the stiffness is symmetric.
        inner: Numbers of the unknowns of all elements of the box, -1 for what is held, (n, 27).
        force: Nodal forces of all [N], (n, 27).
        stiffness: Their derivative [N/m], (n, 27, 27).
        at_interface: Forces at the interface's unknowns, added to [N], (m,).
        across: Derivative of these by the box's unknowns, transposed, added to [N/m], (unknowns, m).
        among: Derivative of these by the interface's unknowns, added to [N/m], (m, m).
    """
    # Of one coarse spline along one direction: what the 27 nodal moves do to it.
    by_nodes = on_stack((27,))
    for e in range(len(edge.numbers)):
        number = edge.numbers[e]
        K = stiffness[number]
        for C in range(9):
            for k in range(3):
                row = edge.unknowns[e, 3 * C + k]
                if row < 0:
                    continue
                by_nodes[:] = 0.0
                # Most weights are zero: a box's edge takes one or two rows of an element's points.
                for A in range(9):
                    weight = edge.weights[e, A, C]
                    if weight != 0.0:
                        at_interface[row] += weight * force[number, 3 * A + k]
                        for r in range(27):
                            by_nodes[r] += weight * K[3 * A + k, r]
                for r in range(27):
                    if inner[number, r] >= 0:
                        across[inner[number, r], row] += by_nodes[r]
                for B in range(9):
                    for D in range(9):
                        weight = edge.weights[e, B, D]
                        if weight != 0.0:
                            for m in range(3):
                                column = edge.unknowns[e, 3 * D + m]
                                if column >= 0:
                                    among[row, column] += weight * by_nodes[3 * B + m]
