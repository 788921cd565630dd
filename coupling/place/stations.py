"""What a path asks of the robot at its places, told in the part frame: it moves with the part."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy.spatial.transform import Rotation, RotationSpline

from coupling.inverse.loads import SmoothWrench
from coupling.path.histories import ToolPath, WrenchHistory
from coupling.path.interpolation import InterpolatedPath
from coupling.toolpaths.part import Part
from coupling.toolpaths.tilt import ToolTilt

# Distance of nodes that links can follow a wrench on, as in the inverse [s].
_SPACING = 0.004
# A path is seen at the strongest places of so many parts of its duration.
_PARTS = 400


@dataclass(frozen=True)
class Stations:
    """Places of a path, part axes.

    Attributes:
        time: [s], (k,).
        position, velocity, acceleration: Of the TCP [m], [m/s], [m/s^2], (k, 3).
        tool: part_from_tool before a setting turns the tool.
        spin, spin_rate: Angular velocity and acceleration of the tool [rad/s], [rad/s^2], (k, 3).
        wrench: On the tool at the TCP, as slow as links can follow [N, N m], (k, 6).
    """

    time: np.ndarray
    position: np.ndarray
    velocity: np.ndarray
    acceleration: np.ndarray
    tool: Rotation
    spin: np.ndarray
    spin_rate: np.ndarray
    wrench: np.ndarray

    @property
    def count(self) -> int:
        """Number k of places."""
        return len(self.time)

    def chosen(self, rows: np.ndarray) -> Stations:
        """Return some of them, by their numbers."""
        return Stations(
            self.time[rows],
            self.position[rows],
            self.velocity[rows],
            self.acceleration[rows],
            self.tool[rows],
            self.spin[rows],
            self.spin_rate[rows],
            self.wrench[rows],
        )

    def strongest(self, parts: int = _PARTS) -> Stations:
        """Return the places where acceleration, force or speed is largest in each part of the time."""
        if self.count <= 3 * parts:
            return self
        part = np.minimum(parts * np.arange(self.count) // self.count, parts - 1)
        rows = [np.array([0, self.count - 1])]
        for values in (self.acceleration, self.wrench[:, :3], self.velocity):
            size = np.linalg.norm(values, axis=1)
            order = np.lexsort((size, part))  # the largest of each part comes last
            rows.append(order[np.append(np.flatnonzero(np.diff(part[order])), self.count - 1)])
        return self.chosen(np.unique(np.concatenate(rows)))


def stations_along(part: Part, path: ToolPath, tilt: ToolTilt, wrench: WrenchHistory) -> Stations:
    """Return all places of a path, one tool.

    Args:
        part: Placement of the part.
        path: Path of the tool, in the world.
        tilt: How the tool is turned on it.
        wrench: Wrench on it at the same times, world axes.
    """
    time, part_from_world = path.time, part.rotation.inv()
    between = InterpolatedPath(path)
    velocity, acceleration = (
        part_from_world.apply(between.position(time, order)) for order in (1, 2)
    )
    tool = tilt.along_path(part_from_world * path.rotations[0])
    turns = RotationSpline(time, tool)
    smooth = SmoothWrench(wrench, _SPACING)(time)
    return Stations(
        time,
        part.coordinates(path.position[0]),
        velocity,
        acceleration,
        tool,
        turns(time, 1),
        turns(time, 2),
        np.hstack([part_from_world.apply(smooth[:, :3]), part_from_world.apply(smooth[:, 3:])]),
    )
