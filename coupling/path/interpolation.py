"""A tool path between its samples."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np
from scipy.interpolate import BSpline, CubicSpline, make_interp_spline
from scipy.spatial.transform import Rotation, RotationSpline

from coupling.path.histories import ToolPath, poses

# A path is at rest at an end where its speed there is below this part of its largest one: what a
# spline that knows nothing of the end makes of a standstill.
_AT_REST = 0.05
# Fewest samples of a quintic spline, and the largest ratio of its steps: uneven ones make it ring.
_MIN_QUINTIC_SAMPLES, _MAX_STEP_RATIO = 12, 3.0

Rest = tuple[bool, bool]


def spline_through(time: np.ndarray, values: np.ndarray, at_rest: Rest) -> BSpline:
    """Return the smooth curve through samples of a motion: a C4 quintic spline.

    Where samples are few or uneven it is the C2 cubic one.  At an end at rest rate and acceleration are
    zero; at others they are those of the spline that knows nothing of the end ("not a knot").

    Args:
        time: Rising times [s], (n,), n >= 2.
        values: Values, any unit, (n, k).
        at_rest: Whether the motion begins and ends at rest.
    """
    steps = np.diff(time)
    even = len(time) >= _MIN_QUINTIC_SAMPLES and steps.max() <= _MAX_STEP_RATIO * steps.min()
    degree, orders = (5, (1, 2)) if even else (3, (1,))
    free = make_interp_spline(time, values, degree) if len(time) > degree else None
    zero = np.zeros(values.shape[1])

    def conditions(end: int) -> list[tuple[int, np.ndarray]]:
        if at_rest[end] or free is None:
            return [(order, zero) for order in orders]
        return [(order, free(time[-end], order)) for order in orders]

    return make_interp_spline(time, values, degree, bc_type=(conditions(0), conditions(1)))


class InterpolatedPath:
    """Path of one tool at any time: `spline_through` its positions, C2 splines of its rotations.

    Args:
        path: Path of one tool.

    Attributes:
        at_rest: Whether it begins and ends at rest, or is cut in mid-motion.

    Example:
        >>> time = np.linspace(0.0, 1.0, 21)
        >>> pose = np.zeros((21, 7)); pose[:, 0] = time**4; pose[:, 6] = 1.0
        >>> path = InterpolatedPath(ToolPath(time, pose))
        >>> path.position(np.array([0.5]), order=1).round(6), path.at_rest
        (array([[0.5, 0. , 0. ]]), (True, False))
    """

    def __init__(self, path: ToolPath) -> None:
        self._path = path
        time, position = path.time, path.position[0]
        speeds = np.linalg.norm(np.diff(position, axis=0), axis=1) / np.diff(time)
        largest = float(speeds.max())
        free = CubicSpline(time, position)
        ends = [float(np.linalg.norm(free(time[k], 1))) for k in (0, -1)]
        self.at_rest: Rest = (ends[0] <= _AT_REST * largest, ends[1] <= _AT_REST * largest)
        self._position = spline_through(time, position, self.at_rest)

    def position(self, time: np.ndarray, order: int = 0) -> np.ndarray:
        """Return positions [m] or their derivatives, (k, 3)."""
        values: np.ndarray = self._position(time, order)
        return values

    def rotation(self, time: np.ndarray) -> Rotation:
        """Return rotations base_from_tool at times (k,) [s]."""
        return self._rotation(time)

    def at(self, time: np.ndarray) -> ToolPath:
        """Return the path at times (k,) [s]."""
        return ToolPath(time, poses(self.position(time), self.rotation(time)))

    @cached_property
    def _rotation(self) -> RotationSpline:
        return RotationSpline(self._path.time, self._path.rotations[0])


def divide_steps(time: np.ndarray, longest: float) -> tuple[np.ndarray, np.ndarray]:
    """Return times with each step divided evenly into ones not longer, and the rows of the given times.

    Args:
        time: Rising times [s], (n,).
        longest: Longest step [s].

    Example:
        >>> divide_steps(np.array([0.0, 0.5, 2.5]), 1.0)
        (array([0. , 0.5, 1.5, 2.5]), array([0, 1, 3]))
    """
    parts = np.maximum(np.ceil(np.diff(time) / longest - 1e-9).astype(int), 1)
    rows = np.concatenate([[0], np.cumsum(parts)])
    fine = np.interp(np.arange(rows[-1] + 1), rows, time)
    fine[rows] = time
    return fine, rows


@dataclass(frozen=True)
class SampledPath:
    """Paths of all tools, at shorter steps than the process is evaluated at.

    Attributes:
        path: The paths.
        sample_rows: Row numbers at which a process is evaluated, (k,).
    """

    path: ToolPath
    sample_rows: np.ndarray

    @classmethod
    def of(cls, path: ToolPath) -> SampledPath:
        """Return paths along which a process is evaluated at every row."""
        return cls(path, np.arange(len(path.time)))

    @property
    def samples(self) -> ToolPath:
        """The paths where the process is evaluated."""
        return self.path.at_rows(self.sample_rows)

    def refined(self, longest: float) -> SampledPath:
        """Return the same paths at shorter steps.

        Args:
            longest: Each step between rows is divided evenly into ones not longer than this [s].
        """
        time, rows = divide_steps(self.path.time, longest)
        if len(time) == len(rows):
            return self
        tools = []
        for tool in self.path.tools:
            between = InterpolatedPath(tool).at(time)
            between.pose[:, rows] = tool.pose
            tools.append(between)
        return SampledPath(ToolPath.of_tools(tools), rows[self.sample_rows])
