"""Contract of a scheme of the coupling, and outcomes of an iteration."""

from __future__ import annotations

from abc import ABC, abstractmethod
from dataclasses import dataclass
from enum import StrEnum
from typing import Protocol

import numpy as np

from coupling.path.histories import ToolPath, WrenchHistory
from coupling.path.joint_path import JointPath
from coupling.process.base import ProcessResponse
from coupling.robot.contract import SimulatedRobot
from elastic_robot.fmi.interface import Mode


@dataclass(frozen=True)
class Iterate:
    """A process's evaluation: the paths, and its response.

    Attributes:
        path: Paths of the tools, at as many times as the robots are simulated.
        rows: Row numbers of the process's samples in them, (n,).
        response: Its response.
    """

    path: ToolPath
    rows: np.ndarray
    response: ProcessResponse

    @property
    def loads(self) -> WrenchHistory:
        """The process's wrenches at the times of the paths."""
        return self.response.wrench.refined(self.path.time)

    @property
    def force(self) -> np.ndarray:
        """Forces at the process's samples [N], (tools, n, 3); at a jump those before it."""
        return self.response.wrench.before[..., :3]


@dataclass(frozen=True)
class LoadedMotion:
    """Motion of robots under the response of a process.

    Attributes:
        loads: Loads on them.
        path: Paths of their tools.
    """

    loads: WrenchHistory
    path: ToolPath


class Scheme(ABC):
    """A scheme: the robots' answer to a process, and the next path from the last ones."""

    def move_robot(
        self, robot: SimulatedRobot, command: JointPath, iterate: Iterate, mode: Mode
    ) -> LoadedMotion:
        """Return the robots' motion after the process has answered.

        Raises:
            SimulationError: If a robot cannot be simulated.
        """
        loads = iterate.loads
        return LoadedMotion(loads, robot.simulate(command, loads, mode))

    @abstractmethod
    def update(self, x: np.ndarray, g: np.ndarray) -> np.ndarray:
        """Return the next iterate from x and g = G(x) [m], all of one shape."""

    @abstractmethod
    def reset(self) -> None:
        """Forget earlier iterates."""


class SchemeBuilder(Protocol):
    """Function that makes a new scheme."""

    def __call__(self, first: float = 1.0) -> Scheme:
        """Return the scheme whose first factor is `first`."""


class Outcome(StrEnum):
    """Verdict on a coupling or a correction; the reason in plain words stands beside it."""

    CONVERGED = "converged"
    DIVERGED = "diverged"
    LIMIT_CYCLE = "limit cycle"
    STAGNATED = "stagnated"
    EXHAUSTED = "exhausted"
    PROCESS_FAILED = "process failed"
    ROBOT_FAILED = "robot failed"
    CHATTERS = "chatters"
