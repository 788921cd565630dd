"""Stiffness of a process along a path, from evaluations."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from coupling.process.base import joined, own_blocks

# Displacement along its force that a tool may make in the first update [m].  The stiffness that this
# asks for should rather be too large, which is slow, than too small, which loses contact.
_FIRST_MOVE = 2e-4
# A tool that moved less between two evaluations says nothing of the stiffness [m].
_LEAST_MOVE = 1e-8
# A force that changes at a right angle to the motion, by this cosine, is no reaction to it.
_LEAST_COSINE = 1e-3


@dataclass(frozen=True)
class ProcessStiffness:
    """Stiffness of a process along the path of all tools, as its evaluations show it.

    Attributes:
        position: Positions of the TCPs that the process saw last [m], (tools, n, 3).
        force: Forces that it answered with [N], (tools, n, 3).
        own: Stiffness that it states, or that explains its answers [N/m], (n, 3 tools, 3 tools).
    """

    position: np.ndarray
    force: np.ndarray
    own: np.ndarray

    @classmethod
    def first(cls, position: np.ndarray, force: np.ndarray) -> ProcessStiffness:
        """Return a guess along the force [N] at positions [m], (tools, n, 3), of one size everywhere."""
        size = np.linalg.norm(force, axis=-1, keepdims=True)
        direction = np.divide(force, size, out=np.zeros_like(force), where=size > 0.0)
        tools, count = force.shape[:2]
        stiffness = np.zeros((count, tools, 3, tools, 3))
        for k, along in enumerate(direction):
            stiffness[:, k, :, k] = float(size.max()) / _FIRST_MOVE * _square(along)
        return cls(position, force, stiffness.reshape(count, 3 * tools, 3 * tools))

    @property
    def usual(self) -> float:
        """Stiffness that is usual along the path [N/m]: the median where there is one, 0 without."""
        sizes = np.trace(own_blocks(self.own), axis1=-2, axis2=-1)
        return float(np.median(sizes[sizes > 0.0])) if np.any(sizes > 0.0) else 0.0

    def then(
        self, position: np.ndarray, force: np.ndarray, stated: np.ndarray | None = None
    ) -> ProcessStiffness:
        """Return the stiffness after one more evaluation, stated [N/m], (n, 3 tools, 3 tools), or not.

        Otherwise that of a sample is the symmetric one of rank one that explains the change of the
        forces on all tools, df df^T / (-df . dx): of all that are not negative the smallest.  It stays
        where no tool moved or the forces did not fall back.
        """
        step = position - self.position
        moves, changed = joined(step), joined(force - self.force)
        work = -np.sum(changed * moves, axis=-1)
        moved, strong = np.linalg.norm(moves, axis=-1), np.linalg.norm(changed, axis=-1)
        falls = (moved > _LEAST_MOVE) & (work > _LEAST_COSINE * moved * strong)
        found = _square(changed) / np.where(falls, work, 1.0)[..., None, None]
        own = np.where(falls[..., None, None], found, self.own) if stated is None else stated
        return ProcessStiffness(position, force, own)


def _square(vectors: np.ndarray) -> np.ndarray:
    """Return v v^T of vectors (..., m)."""
    product: np.ndarray = vectors[..., :, None] * vectors[..., None, :]
    return product
