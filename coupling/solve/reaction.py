"""How a process reacts to a displacement of the tools: its stiffness along a path, from evaluations."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

# Displacement of the tool in the first update, from which the stiffness is then read [m]: small, as a
# stiffness taken too large is safe and one too small lets the tool lose contact.
_FIRST_MOVE = 20e-6
# A tool that moved less between two evaluations tells nothing of the stiffness [m].
_LEAST_MOVE = 1e-8
# A force that changes at a right angle to the motion, by this cosine, is no reaction to it.
_LEAST_COSINE = 1e-3


@dataclass(frozen=True)
class Reaction:
    """What is known of a process along the path of all tools.

    Attributes:
        position: Positions of the TCPs that the process saw [m], (tools, n, 3).
        force: Forces that it answered with [N], (tools, n, 3).
        stiffness: Its stiffness K about there, symmetric and not negative [N/m], (tools, n, 3, 3).
    """

    position: np.ndarray
    force: np.ndarray
    stiffness: np.ndarray

    @classmethod
    def first(cls, position: np.ndarray, force: np.ndarray) -> Reaction:
        """Return a guess from one evaluation: a stiffness along the force, of equal size everywhere."""
        size = np.linalg.norm(force, axis=-1, keepdims=True)
        direction = np.divide(force, size, out=np.zeros_like(force), where=size > 0.0)
        return cls(position, force, float(size.max()) / _FIRST_MOVE * _square(direction))

    def then(self, position: np.ndarray, force: np.ndarray) -> Reaction:
        """Return what is known after one more evaluation.

        The stiffness of a sample is the symmetric one of rank one that explains the change of its force,
        df df^T / (-df . dx); where the tool did not move or the force did not fall back it stays.
        """
        moved, changed = position - self.position, force - self.force
        work = -np.sum(changed * moved, axis=-1)
        far, strong = np.linalg.norm(moved, axis=-1), np.linalg.norm(changed, axis=-1)
        unmoved = far < _LEAST_MOVE
        falls = ~unmoved & (work > _LEAST_COSINE * far * strong)
        secant = _square(changed) / np.where(falls, work, 1.0)[..., None, None]
        stiffness = np.where(falls[..., None, None], secant, self.stiffness)
        return Reaction(position, force, stiffness)


def _square(vectors: np.ndarray) -> np.ndarray:
    """Return v v^T of vectors (..., 3)."""
    product: np.ndarray = vectors[..., :, None] * vectors[..., None, :]
    return product
