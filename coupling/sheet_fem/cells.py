"""Small elements summed up, coarse element by coarse element."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from coupling.sheet_fem.compiled import compiled


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
    own = np.empty((9, 3))
    half, whole, turned = np.empty((9, 81)), np.empty((9, 81)), np.empty((27, 27))
    for e in range(len(places)):
        i, j = places[e, 0], places[e, 1]
        M = blend[i % factor, j % factor]
        into = (i // factor) * columns + j // factor
        np.dot(M.T, force[e].reshape(9, 3), own)
        np.dot(M.T, stiffness[e].reshape(9, 81), half)
        # The stiffness is symmetric: its columns are summed up as its rows are.
        turned[:, :] = half.reshape(27, 27).T
        np.dot(M.T, turned.reshape(9, 81), whole)
        summed[into] += own.reshape(27)
        tangent[into] += whole.reshape(27, 27)
