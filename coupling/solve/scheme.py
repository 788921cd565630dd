"""What a scheme of the coupling is."""

from __future__ import annotations

from abc import ABC, abstractmethod
from typing import Protocol

import numpy as np

from coupling.path.histories import ToolPath, WrenchHistory
from coupling.process.base import Answer


class Scheme(ABC):
    """How the next path follows from the last ones; it may remember them."""

    def loads(self, path: ToolPath, answer: Answer) -> WrenchHistory:
        """Return what acts on the robots after the process has answered to a path: its wrenches.

        Args:
            path: The paths that the process saw, which may be told at more times than it answers.
            answer: Its answer.
        """
        return answer.wrench

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
