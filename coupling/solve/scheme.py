"""What a scheme of the coupling is."""

from __future__ import annotations

from abc import ABC, abstractmethod
from typing import Protocol

import numpy as np

from coupling.path.contact_spring import straight
from coupling.path.histories import ToolPath, WrenchHistory
from coupling.process.base import Answer


class Scheme(ABC):
    """How the next path follows from the last ones; it may remember them."""

    def loads(self, path: ToolPath, rows: np.ndarray, answer: Answer) -> WrenchHistory:
        """Return what acts on the robots after the process has answered to a path, at its times.

        These are the process's wrenches.  Between two of its samples they go straight: held from one
        to the next they would shake a moving robot, and answer late to what it does in between.

        Args:
            path: The paths, at as many times as the robots are simulated.
            rows: Rows of the process's samples in them.
            answer: Its answer.
        """
        wrench = straight(answer.wrench.time, answer.wrench.wrench, path.time)
        return WrenchHistory(path.time, wrench)

    @abstractmethod
    def update(self, x: np.ndarray, g: np.ndarray) -> np.ndarray:
        """Return the next iterate from x and g = G(x), all of one shape."""

    @abstractmethod
    def reset(self) -> None:
        """Forget earlier iterates."""


class SchemeBuilder(Protocol):
    """What makes a new scheme."""

    def __call__(self, first: float = 1.0) -> Scheme:
        """Return the scheme whose first factor is `first`."""
        ...
