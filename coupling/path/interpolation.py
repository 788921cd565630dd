"""A tool path between its samples."""

from __future__ import annotations

from functools import cached_property

import numpy as np
from scipy.interpolate import CubicSpline
from scipy.spatial.transform import Rotation, RotationSpline

from coupling.path.histories import ToolPath, poses

# A path is at rest at an end where its speed there is below this part of its largest one: what a
# spline that knows nothing of the end makes of a standstill.
_AT_REST = 0.05


class InterpolatedPath:
    """Path of one tool at any time: C2 cubic splines through the samples.

    Positions have zero speed at an end where the path is at rest; where it is cut in mid-motion the
    spline's third derivative is continuous at the sample next to the end.

    Args:
        path: Path of one tool.

    Example:
        >>> time = np.linspace(0.0, 1.0, 11)
        >>> pose = np.zeros((11, 7)); pose[:, 0] = time**2; pose[:, 6] = 1.0
        >>> InterpolatedPath(ToolPath(time, pose)).position(np.array([0.25]), order=1).round(9)
        array([[0.5, 0. , 0. ]])
    """

    def __init__(self, path: ToolPath) -> None:
        self._path = path
        ends, speeds = self._ends_and_speeds()
        self.at_rest = (ends[0] <= _AT_REST * speeds, ends[1] <= _AT_REST * speeds)
        standing = (1, np.zeros(3))
        condition = tuple(standing if rest else "not-a-knot" for rest in self.at_rest)
        self._position = CubicSpline(path.time, path.position[0], bc_type=condition)

    def _ends_and_speeds(self) -> tuple[tuple[float, float], float]:
        """Return the speeds at both ends and the largest one [m/s], of a spline free at its ends."""
        free = CubicSpline(self._path.time, self._path.position[0])
        first, last = (float(np.linalg.norm(free(self._path.time[k], 1))) for k in (0, -1))
        steps = np.linalg.norm(np.diff(self._path.position[0], axis=0), axis=1)
        return (first, last), float((steps / np.diff(self._path.time)).max())

    def position(self, time: np.ndarray, order: int = 0) -> np.ndarray:
        """Return positions [m] or their derivatives, (k, 3)."""
        values: np.ndarray = self._position(time, order)
        return values

    def rotation(self, time: np.ndarray) -> Rotation:
        """Return rotations base_from_tool."""
        return self._rotation(time)

    def at(self, time: np.ndarray) -> ToolPath:
        """Return the path at given times, (k,)."""
        return ToolPath(time, poses(self.position(time), self.rotation(time)))

    @cached_property
    def _rotation(self) -> RotationSpline:
        return RotationSpline(self._path.time, self._path.rotations[0])


def refined(path: ToolPath, longest: float) -> tuple[ToolPath, np.ndarray]:
    """Return the paths of all tools at shorter steps, and the row of each of their samples.

    Args:
        path: The paths.
        longest: Each step between samples is divided evenly into ones not longer than this [s].
    """
    parts = np.maximum(np.ceil(np.diff(path.time) / longest - 1e-9).astype(int), 1)
    rows = np.concatenate([[0], np.cumsum(parts)])
    time = np.interp(np.arange(rows[-1] + 1), rows, path.time)
    time[rows] = path.time
    tools = []
    for tool in path.tools:
        between = InterpolatedPath(tool)
        pose = poses(between.position(time), between.rotation(time))
        pose[rows] = tool.pose[0]
        tools.append(ToolPath(time, pose))
    return ToolPath.of_tools(tools), rows
