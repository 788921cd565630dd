"""Poses as programs hold them, one after the other: products, inverses and angles without arrays."""

from __future__ import annotations

from collections.abc import Sequence
from math import acos, atan2, cos, degrees, hypot, radians, sin

from coupling.programs.program import Pose

# Quaternion x, y, z, w.
Quaternion = tuple[float, float, float, float]
_MM = 1e3
# Cosine of b up to which a and c turn about one axis.
_GIMBAL_LOCK_COSINE = 1e-9


def product(a_from_b: Pose, b_from_c: Pose) -> Pose:
    """Return a_from_c.

    Example:
        >>> quarter = pose_of_zyx([0.0, 0.0, 0.0], [90.0, 0.0, 0.0])
        >>> ahead = pose_of_zyx([1000.0, 0.0, 0.0], [0.0, 0.0, 0.0])
        >>> [round(x, 9) + 0.0 for x in product(quarter, ahead)[:3]]
        [0.0, 1.0, 0.0]
    """
    x, y, z = _rotate(a_from_b[3:], b_from_c[:3])
    quaternion = _upright(_times(a_from_b[3:], b_from_c[3:]))
    return (a_from_b[0] + x, a_from_b[1] + y, a_from_b[2] + z, *quaternion)


def inverse(a_from_b: Pose) -> Pose:
    """Return b_from_a."""
    x, y, z, w = a_from_b[3:]
    turn = (-x, -y, -z, w)
    px, py, pz = _rotate(turn, a_from_b[:3])
    return (-px, -py, -pz, *_upright(turn))


def turn_between(a: Pose, b: Pose) -> float:
    """Return the angle between two rotations [rad]."""
    along = abs(sum(x * y for x, y in zip(a[3:], b[3:], strict=True)))
    return 2.0 * acos(min(along, 1.0))


def pose_of_zyx(position_mm: Sequence[float], angles_deg: Sequence[float]) -> Pose:
    """Return the pose at x, y, z [mm] with the rotation Rz(a) Ry(b) Rx(c) of angles a, b, c [deg]."""
    (sa, ca), (sb, cb), (sc, cc) = (
        (sin(0.5 * radians(angle)), cos(0.5 * radians(angle))) for angle in angles_deg
    )
    quaternion = (
        ca * cb * sc - sa * sb * cc,
        ca * sb * cc + sa * cb * sc,
        sa * cb * cc - ca * sb * sc,
        ca * cb * cc + sa * sb * sc,
    )
    x, y, z = position_mm
    return (x / _MM, y / _MM, z / _MM, *_upright(quaternion))


def zyx_of_pose(pose: Pose) -> tuple[float, float, float]:
    """Return angles a, b, c [deg] of a pose's rotation Rz(a) Ry(b) Rx(c).

    Where a and c turn about one axis, c is zero.

    Example:
        >>> [round(angle, 9) for angle in zyx_of_pose(pose_of_zyx([0.0, 0.0, 0.0], [10.0, 20.0, 30.0]))]
        [10.0, 20.0, 30.0]
    """
    x, y, z, w = pose[3:]
    xx, xy, xz = 1.0 - 2.0 * (y * y + z * z), 2.0 * (x * y + z * w), 2.0 * (x * z - y * w)
    yx, yy = 2.0 * (x * y - z * w), 1.0 - 2.0 * (x * x + z * z)
    zx, zy = 2.0 * (x * z + y * w), 2.0 * (y * z - x * w)
    level = hypot(xx, xy)
    a = atan2(xy, xx) if level > _GIMBAL_LOCK_COSINE else atan2(-yx, yy)
    b = atan2(-xz, level)
    # The turn that is left about the new x axis, for this a even where a is only just defined.
    c = atan2(sin(a) * zx - cos(a) * zy, cos(a) * yy - sin(a) * yx)
    return degrees(a), degrees(b), degrees(c)


def pose_of_quaternion(position_mm: Sequence[float], quaternion: Sequence[float]) -> Pose:
    """Return the pose at x, y, z [mm] of a quaternion w, x, y, z, which is normalised here."""
    w, x, y, z = quaternion
    length = (w * w + x * x + y * y + z * z) ** 0.5
    px, py, pz = position_mm
    turn = (x / length, y / length, z / length, w / length)
    return (px / _MM, py / _MM, pz / _MM, *_upright(turn))


def _times(a: Sequence[float], b: Sequence[float]) -> Quaternion:
    """Return the product of two quaternions x, y, z, w."""
    ax, ay, az, aw = a
    bx, by, bz, bw = b
    return (
        aw * bx + ax * bw + ay * bz - az * by,
        aw * by - ax * bz + ay * bw + az * bx,
        aw * bz + ax * by - ay * bx + az * bw,
        aw * bw - ax * bx - ay * by - az * bz,
    )


def _rotate(quaternion: Sequence[float], vector: Sequence[float]) -> tuple[float, float, float]:
    """Return a vector turned by a quaternion x, y, z, w."""
    qx, qy, qz, qw = quaternion
    vx, vy, vz = vector
    tx, ty, tz = 2.0 * (qy * vz - qz * vy), 2.0 * (qz * vx - qx * vz), 2.0 * (qx * vy - qy * vx)
    return (
        vx + qw * tx + qy * tz - qz * ty,
        vy + qw * ty + qz * tx - qx * tz,
        vz + qw * tz + qx * ty - qy * tx,
    )


def _upright(quaternion: Quaternion) -> Quaternion:
    """Return the quaternion of the same rotation whose last number is not negative."""
    x, y, z, w = quaternion
    return (-x, -y, -z, -w) if w < 0.0 else quaternion
