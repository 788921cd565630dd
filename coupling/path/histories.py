"""The three histories that travel between robot and process; all frozen, all on a time axis.

In a cell of several robots their tools move at the same time: paths and wrenches then hold the columns
of one tool beside those of the next, and `tools` takes them apart.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from scipy.spatial.transform import Rotation

from coupling.path.workpiece import Workpiece

_POSE, _TWIST, _WRENCH = 7, 6, 6  # columns of one tool


def _require_history(time: np.ndarray, values: np.ndarray, columns: int, name: str) -> None:
    if time.ndim != 1 or len(time) < 2 or values.ndim != 2 or len(values) != len(time):
        raise ValueError(f"{name}: time has shape {time.shape}, values {values.shape}")
    if values.shape[1] == 0 or values.shape[1] % columns != 0:
        raise ValueError(f"{name}: {values.shape[1]} columns; needed are {columns} for each tool")
    if not np.all(np.isfinite(time)) or not np.all(np.isfinite(values)):
        raise ValueError(f"{name}: a value is not finite")
    if np.any(np.diff(time) <= 0.0):
        row = int(np.argmax(np.diff(time) <= 0.0))
        raise ValueError(
            f"{name}: time goes from {time[row]:.9g} to {time[row + 1]:.9g} s in row {row + 2};"
            " needed are rising times"
        )


def _side_by_side(values: np.ndarray, columns: int) -> list[np.ndarray]:
    """Return the columns of every tool."""
    return np.split(values, values.shape[1] // columns, axis=1)


def _one_time(histories: Sequence[ToolPath] | Sequence[WrenchHistory], name: str) -> np.ndarray:
    time = histories[0].time
    if not all(np.array_equal(history.time, time) for history in histories):
        raise ValueError(f"{name}: the tools are given at different times")
    return time


@dataclass(frozen=True)
class ToolPath:
    """Poses of the TCP over time, in the robot's base frame; in a cell, of all TCPs in the world's.

    Attributes:
        time: Rising [s], (n,).
        pose: x, y, z, qx, qy, qz, qw of each tool, (n, 7) for one.

    Raises:
        ValueError: If sizes do not agree, time does not rise or a value is not finite.

    Example:
        >>> time = np.array([0.0, 1.0])
        >>> path = ToolPath(time, np.array([[0, 0, 0, 0, 0, 0, 1.0], [1, 0, 0, 0, 0, 0, 1.0]]))
        >>> lifted = path.displaced(np.array([[0, 0, 2e-3, 0, 0, 0]] * 2))
        >>> lifted.deviation_from(path)[:, 2]
        array([0.002, 0.002])
    """

    time: np.ndarray
    pose: np.ndarray

    def __post_init__(self) -> None:
        _require_history(self.time, self.pose, _POSE, "tool path")

    @classmethod
    def of_tools(cls, paths: Sequence[ToolPath]) -> ToolPath:
        """Return the path of several tools that move at the same time."""
        time = _one_time(paths, "tool path")
        return cls(time, np.hstack([path.pose for path in paths]))

    @property
    def tools(self) -> tuple[ToolPath, ...]:
        """The path of every tool."""
        return tuple(ToolPath(self.time, pose) for pose in _side_by_side(self.pose, _POSE))

    @property
    def position(self) -> np.ndarray:
        """TCP positions of a single tool [m], (n, 3)."""
        return self._single[:, :3]

    @property
    def rotation(self) -> Rotation:
        """Rotations base_from_tool of a single tool."""
        return Rotation.from_quat(self._single[:, 3:])

    @property
    def _single(self) -> np.ndarray:
        if self.pose.shape[1] != _POSE:
            raise ValueError(f"the path is that of {len(self.tools)} tools; needed is one")
        return self.pose

    def deviation_from(self, reference: ToolPath) -> np.ndarray:
        """Return position difference [m] and rotation vector [rad] from a reference.

        (n, 6) for one tool; the columns of further tools beside it.
        """
        columns = []
        for own, other in zip(self.tools, reference.tools, strict=True):
            turn = own.rotation * other.rotation.inv()
            columns += [own.position - other.position, turn.as_rotvec()]
        return np.hstack(columns)

    def distance_to(self, other: ToolPath) -> np.ndarray:
        """Return the distances at equal times [m], (n,): of the tool that is farthest off."""
        pairs = zip(self.tools, other.tools, strict=True)
        distances = [np.linalg.norm(a.position - b.position, axis=1) for a, b in pairs]
        return np.max(distances, axis=0)

    def displaced(self, deviation: np.ndarray) -> ToolPath:
        """Return the path that deviates from this one, by six columns for each tool."""
        columns = []
        for own, twist in zip(self.tools, _side_by_side(deviation, _TWIST), strict=True):
            quaternion = (Rotation.from_rotvec(twist[:, 3:]) * own.rotation).as_quat()
            quaternion *= np.where(quaternion[:, 3:] < 0.0, -1.0, 1.0)
            columns += [own.position + twist[:, :3], quaternion]
        return ToolPath(self.time, np.hstack(columns))


@dataclass(frozen=True)
class JointPath:
    """Drive angles over time.

    Attributes:
        time: Rising [s], (n,).
        q: [rad], (n, joints); in a cell, the joints of one robot beside those of the next.

    Raises:
        ValueError: As for ToolPath.
    """

    time: np.ndarray
    q: np.ndarray

    def __post_init__(self) -> None:
        _require_history(self.time, self.q, 1, "joint path")


@dataclass(frozen=True)
class WrenchHistory:
    """Wrench on the tool at the TCP over time, base axes.

    Row k acts over the step that ends at time[k]; row 0 acts in initialisation.

    Attributes:
        time: Rising [s], (n,).
        wrench: fx, fy, fz [N], mx, my, mz [N m] on each tool, (n, 6) for one.
        workpiece: What the process leaves to look at, if anything.

    Raises:
        ValueError: As for ToolPath.
    """

    time: np.ndarray
    wrench: np.ndarray
    workpiece: Workpiece | None = None

    def __post_init__(self) -> None:
        _require_history(self.time, self.wrench, _WRENCH, "wrench history")

    @classmethod
    def none(cls, time: np.ndarray, tools: int = 1) -> WrenchHistory:
        """Return no load at all."""
        return cls(time, np.zeros((len(time), _WRENCH * tools)))

    @classmethod
    def of_tools(cls, histories: Sequence[WrenchHistory]) -> WrenchHistory:
        """Return the wrenches on several tools at the same time."""
        time = _one_time(histories, "wrench history")
        return cls(time, np.hstack([history.wrench for history in histories]))

    @property
    def tools(self) -> tuple[WrenchHistory, ...]:
        """The wrenches on every tool."""
        parts = _side_by_side(self.wrench, _WRENCH)
        return tuple(WrenchHistory(self.time, wrench) for wrench in parts)

    @property
    def peak_force(self) -> float:
        """Largest force on a tool [N]."""
        parts = _side_by_side(self.wrench, _WRENCH)
        return max(float(np.linalg.norm(wrench[:, :3], axis=1).max()) for wrench in parts)

    def change_from(self, other: WrenchHistory) -> float:
        """Return the largest force difference on a tool relative to the larger peak force."""
        largest = WrenchHistory(self.time, self.wrench - other.wrench).peak_force
        return largest / max(self.peak_force, other.peak_force) if largest > 0.0 else 0.0
