"""Rotations as the makers write them, and poses of their numbers."""

from __future__ import annotations

import warnings
from collections.abc import Sequence

import numpy as np
from scipy.spatial.transform import Rotation

from coupling.programs.poses import pose_of_zyx
from coupling.programs.program import Pose


def abc_of(poses: np.ndarray) -> np.ndarray:
    """Return KUKA's A, B, C [deg] of rotations: R = Rz(A) Ry(B) Rx(C), that is Z, Y', X''.

    At B = +-90 deg only a sum or difference of A and C is fixed; C is then chosen as zero.

    Args:
        poses: Rows of x, y, z [m], qx, qy, qz, qw, (n, 7).

    Example:
        >>> import numpy as np
        >>> abc_of(np.array([[0, 0, 0, 0, 0, 0.5**0.5, 0.5**0.5]])).round(6) + 0.0
        array([[90.,  0.,  0.]])
    """
    return _euler(poses)


def wpr_of(poses: np.ndarray) -> np.ndarray:
    """Return FANUC's W, P, R [deg], (n, 3), about the fixed axes x, y, z: R = Rz(R) Ry(P) Rx(W).

    Args:
        poses: Rows of x, y, z [m], qx, qy, qz, qw, (n, 7).
    """
    return _euler(poses)[:, ::-1]


def _euler(poses: np.ndarray) -> np.ndarray:
    """Return angles about z, y', x'' [deg], the last zero in a gimbal lock, (n, 3)."""
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")  # of a lock
        angles: np.ndarray = Rotation.from_quat(poses[:, 3:]).as_euler("ZYX", degrees=True)
    return angles


def pose_of_abc(numbers: Sequence[float]) -> Pose:
    """Return the pose of x, y, z [mm] and KUKA's A, B, C [deg]."""
    return pose_of_zyx(numbers[:3], numbers[3:])


def pose_of_wpr(numbers: Sequence[float]) -> Pose:
    """Return the pose of x, y, z [mm] and FANUC's W, P, R [deg]."""
    x, y, z, w, p, r = numbers
    return pose_of_zyx((x, y, z), (r, p, w))
