"""Motion and wrench at places of a path in the part frame: they move with the part."""

from __future__ import annotations

from dataclasses import dataclass, fields

import numpy as np
from scipy.spatial.transform import Rotation, RotationSpline

from coupling.inverse.smooth_wrench import SmoothWrench
from coupling.path.histories import WrenchHistory
from coupling.path.interpolation import InterpolatedPath
from coupling.toolpaths.untilted import UntiltedPath

# Distance of nodes that links can follow a wrench on, as in the inverse [s].
_SPACING = 0.004
# A path is looked at at the strongest places of so many parts of its duration.
_PART_COUNT = 400
# A radian is as far as so much [m].
_ARM = 0.2


@dataclass(frozen=True)
class Stations:
    """Places of a path, part axes.

    Attributes:
        time: Time of each [s], (k,).
        position, velocity, acceleration: Motion of the TCP [m], [m/s], [m/s^2], (k, 3).
        tool: part_from_tool before a setting turns the tool.
        spin, spin_rate: Angular velocity and acceleration of the tool [rad/s], [rad/s^2], (k, 3).
        axes: Axes that lead and lean are measured in.
        turn, turn_rate: Their angular velocity and acceleration [rad/s], [rad/s^2], (k, 3).
        wrench: Wrench on the tool at the TCP, as slow as links can follow [N, N m], (k, 6).
        centered: Whether the TCP is the centre of the tool's sphere, because the tool may turn along the
            path; else it is the sphere's lowest point.
    """

    time: np.ndarray
    position: np.ndarray
    velocity: np.ndarray
    acceleration: np.ndarray
    tool: Rotation
    spin: np.ndarray
    spin_rate: np.ndarray
    axes: Rotation
    turn: np.ndarray
    turn_rate: np.ndarray
    wrench: np.ndarray
    centered: bool

    @property
    def count(self) -> int:
        """Number k of places."""
        return len(self.time)

    @property
    def poses(self) -> np.ndarray:
        """Positions, and orientations of tool and axes as lengths [m], (k, 15)."""
        vectors = [
            rotations.apply(axis) for rotations in (self.tool, self.axes) for axis in np.eye(3)[:2]
        ]
        return np.hstack([self.position, *(_ARM * directions for directions in vectors)])

    def chosen(self, rows: np.ndarray) -> Stations:
        """Return the places of these numbers, (p,)."""
        arrays = {field.name: getattr(self, field.name) for field in fields(self)}
        centered = arrays.pop("centered")
        return Stations(
            **{name: values[rows] for name, values in arrays.items()}, centered=centered
        )

    def strongest(self) -> Stations:
        """Return the places where acceleration, force or speed is largest in each part of the time."""
        if self.count <= 3 * _PART_COUNT:
            return self
        part = np.minimum(_PART_COUNT * np.arange(self.count) // self.count, _PART_COUNT - 1)
        rows = [np.array([0, self.count - 1])]
        for values in (self.acceleration, self.wrench[:, :3], self.velocity):
            size = np.linalg.norm(values, axis=1)
            order = np.lexsort((size, part))  # the largest of each part comes last
            rows.append(order[np.append(np.flatnonzero(np.diff(part[order])), self.count - 1)])
        return self.chosen(np.unique(np.concatenate(rows)))


def stations_along(untilted: UntiltedPath, sphere_radius: float, wrench: WrenchHistory) -> Stations:
    """Return all places of a path, one tool.

    Args:
        sphere_radius: Radius of the tool's end [m].
        wrench: Wrench on the tool at the same times, world axes.
    """
    centered = untilted.turns
    along = untilted.centered(sphere_radius) if centered else untilted
    path, time, part_from_world = along.path, along.path.time, along.part.rotation.inv()
    between = InterpolatedPath(path)
    velocity, acceleration = (
        part_from_world.apply(between.position(time, order)) for order in (1, 2)
    )
    tool = untilted.along_path
    axes = Rotation.identity(len(time)) if untilted.axes is None else untilted.axes
    smooth = SmoothWrench(wrench, _SPACING)(time)
    return Stations(
        time,
        along.part.coordinates(path.position[0]),
        velocity,
        acceleration,
        tool,
        *_turning(time, tool),
        axes,
        *_turning(time, axes),
        np.hstack([part_from_world.apply(smooth[:, :3]), part_from_world.apply(smooth[:, 3:])]),
        centered,
    )


def _turning(time: np.ndarray, rotations: Rotation) -> tuple[np.ndarray, np.ndarray]:
    """Return angular velocities [rad/s] and accelerations [rad/s^2] of what turns, part axes, (k, 3)."""
    spline = RotationSpline(time, rotations)
    # SciPy gives them in axes that turn along.
    return rotations.apply(spline(time, 1)), rotations.apply(spline(time, 2))
