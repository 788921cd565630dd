"""What a scheme of the coupling is."""

from __future__ import annotations

from abc import ABC, abstractmethod
from typing import Protocol

import numpy as np

from coupling.path.contact_spring import straight
from coupling.path.histories import ToolPath, WrenchHistory
from coupling.process.base import Answer
from elastic_robot.fmi.interface import Mode


class Scheme(ABC):
    """How the next path follows from the last ones; it may remember them."""

    def loads(self, path: ToolPath, rows: np.ndarray, answer: Answer, mode: Mode) -> WrenchHistory:
        """Return what acts on the robots after the process has answered to a path, at its times.

        These are the process's wrenches, straight between its samples; a moving robot gets their mean
        over each of its steps.  Held from sample to sample they would shake it, and would not belong to
        what it does at that time.  A process that beats tells means over its steps already.

        Args:
            path: The paths, at as many times as the robots are simulated.
            rows: Rows of the process's samples in them.
            answer: Its answer.
            mode: How the robots are simulated.
        """
        wrench = straight(answer.wrench.time, answer.wrench.wrench, path.time)
        if mode == "dynamic" and answer.period is None:
            wrench[:, 1:] = 0.5 * (wrench[:, 1:] + wrench[:, :-1])
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
