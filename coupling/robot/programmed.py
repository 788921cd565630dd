"""Paths as the program of a touched-off robot has them."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy.spatial.transform import Rotation

from coupling.path.histories import ToolPath, poses


@dataclass(frozen=True)
class TouchOff:
    """What a robot takes for the world, because it was touched off where it stood with its sag.

    Where its controller shows a point p, the tool at rest was at position + rotation p, world axes.

    Attributes:
        position: Of what is shown as the world's origin [m], (3,).
        rotation: real_from_commanded.
        residual: Largest distance of a touched point from that [m].

    Example:
        >>> sagged = TouchOff(np.array([0.0, 0.0, -0.008]), Rotation.identity(), 0.0)
        >>> path = ToolPath(np.array([0.0, 1.0]), np.tile([1.0, 0, 0, 0, 0, 0, 1.0], (2, 1)))
        >>> sagged.programmed(path).position[0, 0].tolist()
        [1.0, 0.0, 0.008]
    """

    position: np.ndarray
    rotation: Rotation
    residual: float

    def real(self, points: np.ndarray) -> np.ndarray:
        """Return where points really are that the controller shows, world axes [m], (..., 3)."""
        found: np.ndarray = self.position + self.rotation.apply(points)
        return found

    def shown(self, points: np.ndarray) -> np.ndarray:
        """Return what the controller shows of real points, world axes [m], (..., 3)."""
        found: np.ndarray = self.rotation.inv().apply(points - self.position)
        return found

    def programmed(self, path: ToolPath) -> ToolPath:
        """Return a real path of one tool in the world as the program has it."""
        rotation = self.rotation.inv() * path.rotations[0]
        return ToolPath(path.time, poses(self.shown(path.position[0]), rotation))
