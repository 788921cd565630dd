"""A process linearised at one of its evaluations."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from coupling.path.contact_spring import ContactSpring
from coupling.path.histories import ToolPath
from coupling.path.linear import interpolated
from coupling.process.base import joined
from coupling.solve.scheme import Iterate


@dataclass(frozen=True)
class LinearProcess:
    """F(x) = F(x_k) + K (x_k - x) at the samples of the process, straight between them.

    Attributes:
        seen: The path x_k and the answer to it.
        stiffness: K at the samples [N/m], (n, 3 tools, 3 tools).
    """

    seen: Iterate
    stiffness: np.ndarray

    def change(self, path: ToolPath) -> np.ndarray:
        """Return by how much the forces [N] on a path differ from those answered, (tools, k, 3)."""
        moved = (self.seen.path.position - path.position)[:, self.seen.rows]
        change = np.einsum("nij,nj->ni", self.stiffness, joined(moved))
        tools = change.reshape(len(change), -1, 3).swapaxes(0, 1)
        return interpolated(path.time, self.seen.answer.wrench.instants, tools, axis=1)

    def beyond(self, spring: ContactSpring, path: ToolPath) -> np.ndarray:
        """Return the part of this change that springs to x_k do not give [N], (tools, k, 3)."""
        return self.change(path) - spring.force(path.position)
