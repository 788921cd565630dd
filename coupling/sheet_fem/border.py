"""A band matrix with a dense border: the unknowns of a box and those of its interface."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from coupling.sheet_fem.banded import GeneralBanded, SymmetricBanded
from coupling.sheet_fem.compiled import compile_function


@dataclass(frozen=True)
class Bordered:
    """The matrix [[inner, across], [across^T, outer]].

    Attributes:
        inner: Band matrix, (n, n).
        across: Matrix of inner rows and outer columns, (n, m).
        outer: Matrix of outer rows and columns, (m, m).
    """

    inner: SymmetricBanded | GeneralBanded
    across: np.ndarray
    outer: np.ndarray

    @property
    def size(self) -> int:
        """Number of unknowns."""
        return sum(self.across.shape)

    def solve(self, right: np.ndarray) -> np.ndarray:
        """Return the solution for a right-hand side, any unit, (n + m,), or k of them, (n + m, k)."""
        n, m = self.across.shape
        columns = right.reshape(n + m, -1)
        factor = self.inner.factor()
        half = factor.forward(np.hstack([self.across, columns[:n]]))
        adjoint = factor.adjoint(self.across, half[:, :m])
        schur = self.outer - adjoint.T @ half[:, :m]
        outer = np.linalg.solve(schur, columns[n:] - adjoint.T @ half[:, m:])
        inner = factor.backward(half[:, m:] - half[:, :m] @ outer)
        return np.vstack([inner, outer]).reshape(right.shape)


@compile_function
def add_border(
    inner: np.ndarray,
    outer: np.ndarray,
    across: np.ndarray,
    among: np.ndarray,
    to_across: np.ndarray,
    to_outer: np.ndarray,
) -> None:
    """Add elements' matrices to a border.

    Args:
        inner: Numbers of the elements' columns among inner unknowns, -1 for none, (elements, 27).
        outer: Numbers of their rows among outer unknowns, -1 for none, (elements, 27).
        across: Matrices of outer rows and inner columns, (elements, 27, 27).
        among: Matrices of outer rows and columns, (elements, 27, 27).
        to_across: Matrix of inner rows and outer columns, added to, (n, m).
        to_outer: Matrix of outer rows and columns, added to, (m, m).
    """
    for e in range(len(inner)):
        for r in range(27):
            row = outer[e, r]
            if row < 0:
                continue
            for c in range(27):
                if inner[e, c] >= 0:
                    to_across[inner[e, c], row] += across[e, r, c]
                if outer[e, c] >= 0:
                    to_outer[row, outer[e, c]] += among[e, r, c]
