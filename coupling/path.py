"""The three histories that travel between robot and process; all frozen, all on a time axis."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy.spatial.transform import Rotation

from coupling.workpiece import Workpiece


def _require_history(time: np.ndarray, values: np.ndarray, columns: int | None, name: str) -> None:
    if time.ndim != 1 or len(time) < 2 or values.ndim != 2 or len(values) != len(time):
        raise ValueError(f"{name}: time has shape {time.shape}, values {values.shape}")
    if columns is not None and values.shape[1] != columns:
        raise ValueError(f"{name}: {values.shape[1]} columns; needed are {columns}")
    if not np.all(np.isfinite(time)) or not np.all(np.isfinite(values)):
        raise ValueError(f"{name}: a value is not finite")
    if np.any(np.diff(time) <= 0.0):
        row = int(np.argmax(np.diff(time) <= 0.0))
        raise ValueError(
            f"{name}: time goes from {time[row]:.9g} to {time[row + 1]:.9g} s in row {row + 2};"
            " needed are rising times"
        )


@dataclass(frozen=True)
class ToolPath:
    """Poses of the TCP over time, in the robot's base frame.

    Attributes:
        time: Rising [s], (n,).
        pose: x, y, z, qx, qy, qz, qw, (n, 7).

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
        _require_history(self.time, self.pose, 7, "tool path")

    @property
    def position(self) -> np.ndarray:
        """TCP positions [m], (n, 3)."""
        return self.pose[:, :3]

    @property
    def rotation(self) -> Rotation:
        """Rotations base_from_tool."""
        return Rotation.from_quat(self.pose[:, 3:])

    def deviation_from(self, reference: ToolPath) -> np.ndarray:
        """Return position difference [m] and rotation vector [rad] from a reference, (n, 6)."""
        turn = self.rotation * reference.rotation.inv()
        return np.hstack([self.position - reference.position, turn.as_rotvec()])

    def distance_to(self, other: ToolPath) -> np.ndarray:
        """Return the distances between the positions at equal times [m], (n,)."""
        distance: np.ndarray = np.linalg.norm(self.position - other.position, axis=1)
        return distance

    def displaced(self, deviation: np.ndarray) -> ToolPath:
        """Return the path that deviates by (n, 6) from this one."""
        turned = Rotation.from_rotvec(deviation[:, 3:]) * self.rotation
        quaternion = turned.as_quat()
        quaternion *= np.where(quaternion[:, 3:] < 0.0, -1.0, 1.0)
        return ToolPath(self.time, np.hstack([self.position + deviation[:, :3], quaternion]))


@dataclass(frozen=True)
class JointPath:
    """Drive angles over time.

    Attributes:
        time: Rising [s], (n,).
        q: [rad], (n, joints).

    Raises:
        ValueError: As for ToolPath.
    """

    time: np.ndarray
    q: np.ndarray

    def __post_init__(self) -> None:
        _require_history(self.time, self.q, None, "joint path")


@dataclass(frozen=True)
class WrenchHistory:
    """Wrench on the tool at the TCP over time, base axes.

    Row k acts over the step that ends at time[k]; row 0 acts in initialisation.

    Attributes:
        time: Rising [s], (n,).
        wrench: fx, fy, fz [N], mx, my, mz [N m], (n, 6).
        workpiece: What the process leaves to look at, if anything.

    Raises:
        ValueError: As for ToolPath.
    """

    time: np.ndarray
    wrench: np.ndarray
    workpiece: Workpiece | None = None

    def __post_init__(self) -> None:
        _require_history(self.time, self.wrench, 6, "wrench history")

    @classmethod
    def none(cls, time: np.ndarray) -> WrenchHistory:
        """Return no load at all."""
        return cls(time, np.zeros((len(time), 6)))

    @property
    def peak_force(self) -> float:
        """Largest force [N]."""
        return float(np.max(np.linalg.norm(self.wrench[:, :3], axis=1)))

    def change_from(self, other: WrenchHistory) -> float:
        """Return the largest force difference relative to the larger peak force."""
        largest = float(np.linalg.norm((self.wrench - other.wrench)[:, :3], axis=1).max())
        return largest / max(self.peak_force, other.peak_force) if largest > 0.0 else 0.0
