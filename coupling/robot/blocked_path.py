"""A path that a robot cannot follow: where it stops, in which posture, and what is in the way."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal

import numpy as np

from coupling.errors import PlanningError
from coupling.path.histories import ToolPath
from elastic_robot.description import Robot


@dataclass(frozen=True)
class Obstacle:
    """What keeps a robot from going on.

    Attributes:
        kind: "reach": the tool stays away from its place; "limit": a joint would pass its limit;
            "singular": a joint would have to move infinitely fast; "jump": one would have to jump.
        joint: Joint by number from 1; out of reach, the one that moved farthest.
        size: Distance that the tool stays away [m], or angle of the jump [rad]; 0 for others.
    """

    kind: Literal["reach", "limit", "singular", "jump"]
    joint: int
    size: float = 0.0


@dataclass(frozen=True)
class BlockedPath:
    """A path that a robot follows up to one of its samples.

    Attributes:
        path: Path of the tool, in the robot's base.
        row: First sample that it cannot take, from 0; of a limit, the first beyond it.
        angles: Joint angles from the first sample on, at least up to that one [rad], (k, joints); out
            of reach, the last are those that come nearest.
    """

    path: ToolPath
    row: int
    angles: np.ndarray
    obstacle: Obstacle

    @property
    def time(self) -> float:
        """Time of that sample [s]."""
        return float(self.path.time[self.row])


class UnreachableError(PlanningError):
    """A robot cannot follow a path.

    Attributes:
        robot: The robot.
        blocked: The path and where it stops.
    """

    def __init__(self, words: str, robot: Robot, blocked: BlockedPath) -> None:
        super().__init__(f"sample {blocked.row + 1}, t = {blocked.time:.3f} s: {words}")
        self.robot, self.blocked = robot, blocked
