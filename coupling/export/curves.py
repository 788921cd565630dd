"""A sampled motion, of poses or of joint angles, and how far another one is off at the tool."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Protocol

import numpy as np


class SampledCurve(Protocol):
    """A motion at its samples."""

    @property
    def values(self) -> np.ndarray:
        """Values that a controller interpolates, [m] and unit quaternions or [rad], (n, k)."""

    def between(self, start: np.ndarray, end: np.ndarray, share: np.ndarray) -> np.ndarray:
        """Return the values on the straight way from some values to others.

        Args:
            start, end: Values, units as of `values`, (m, k).
            share: Share of the way, 0 to 1, (m,).
        """

    def errors(self, values: np.ndarray, rows: slice | np.ndarray) -> np.ndarray:
        """Return how far values are off at the tool [m], (m,).

        Args:
            values: Values in place of the motion's own in these rows, its units, (m, k).
            rows: The rows, or their numbers, (m,).
        """


def continuous(quaternion: np.ndarray) -> np.ndarray:
    """Return the same rotations, each quaternion on the side of the last one, (n, 4)."""
    flips = np.sum(quaternion[1:] * quaternion[:-1], axis=1) < 0.0
    signs = np.cumprod(np.concatenate([[1.0], np.where(flips, -1.0, 1.0)]))
    return quaternion * signs[:, None]


@dataclass(frozen=True)
class PoseCurve:
    """Poses of the TCP.

    A rotation counts as what it moves the wrist, which a tool that turns about its TCP carries along.

    Attributes:
        values: x, y, z [m], qx, qy, qz, qw, (n, 7); quaternions of neighbours on one side.
        lever: Vector from the TCP to the wrist [m].

    Example:
        >>> still = np.tile([0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 1.0], (3, 1))
        >>> turned = still[1:2] + [0.0, 0.0, 0.0, 0.0, 0.0, 1e-6, 0.0]
        >>> PoseCurve(still, lever=0.5).errors(turned, slice(1, 2)).round(9)
        array([1.e-06])
    """

    values: np.ndarray
    lever: float

    def between(self, start: np.ndarray, end: np.ndarray, share: np.ndarray) -> np.ndarray:
        """Return poses on a straight line, turning evenly about one axis."""
        cosine = np.clip(np.sum(start[:, 3:] * end[:, 3:], axis=1), -1.0, 1.0)
        far = np.where(cosine[:, None] < 0.0, -end[:, 3:], end[:, 3:])
        angle = np.arccos(np.abs(cosine))
        small = angle < _SMALL_ANGLE
        sine = np.where(small, 1.0, np.sin(angle))
        first = np.where(small, 1.0 - share, np.sin((1.0 - share) * angle) / sine)
        second = np.where(small, share, np.sin(share * angle) / sine)
        quaternion = first[:, None] * start[:, 3:] + second[:, None] * far
        quaternion /= np.linalg.norm(quaternion, axis=1, keepdims=True)
        position = start[:, :3] + share[:, None] * (end[:, :3] - start[:, :3])
        return np.hstack([position, quaternion])

    def errors(self, values: np.ndarray, rows: slice | np.ndarray) -> np.ndarray:
        """Return the larger of the distance and of what the rotation moves the wrist [m], (m,)."""
        pose = self.values[rows]
        apart, quaternion = values[:, :3] - pose[:, :3], values[:, 3:]
        along = np.einsum("ij,ij->i", quaternion, pose[:, 3:])
        scale = np.copysign(1.0 / _norms(quaternion), along)
        half = scale[:, None] * quaternion - pose[:, 3:]
        return np.maximum(_norms(apart), 2.0 * self.lever * _norms(half))


# Angle between quaternions below which sines are taken for their arguments.
_SMALL_ANGLE = 1e-7


@dataclass(frozen=True)
class JointCurve:
    """Joint angles.

    Attributes:
        values: Angles of the robot file's joints [rad], (n, joints).
        jacobian: Motion of the TCP [m/rad] and rotation [rad/rad] with the angles, (n, 6, joints).
        lever: Vector from the TCP to the wrist [m].
    """

    values: np.ndarray
    jacobian: np.ndarray
    lever: float

    def between(self, start: np.ndarray, end: np.ndarray, share: np.ndarray) -> np.ndarray:
        """Return angles that run in proportion."""
        return start + share[:, None] * (end - start)

    def errors(self, values: np.ndarray, rows: slice | np.ndarray) -> np.ndarray:
        """Return the larger of the TCP's distance and of what its rotation moves the wrist [m], (m,)."""
        displacement = np.einsum("nij,nj->ni", self.jacobian[rows], values - self.values[rows])
        return np.maximum(_norms(displacement[:, :3]), self.lever * _norms(displacement[:, 3:]))


def _norms(rows: np.ndarray) -> np.ndarray:
    """Return the norms of vectors (n, k); an einsum is many times faster than `np.linalg.norm`."""
    return np.sqrt(np.einsum("ij,ij->i", rows, rows))
