"""Does a gear reverse?  Figures of the torque that its links need, for one path or for many.

Torques are T = -(M theta'' + h - J^T w) in the gear's row, what the gear passes on to its link
(`coupling.inverse.gears`).  Time is their first axis; gears, and settings before or behind them, are the
others.  A gear reverses where T changes sign, and it has then moved by twice its half width B.
"""

from __future__ import annotations

import ctypes

import numpy as np

from coupling.native.desk_library import loaded_library
from coupling.native.desk_robot import address, numbers
from elastic_robot.settings import SETTINGS

# A torque that would need longer to push a gear through its backlash counts as none [s].
_LONG = 1.0
# Errors in the backlash and in the slip torques that nobody can rule out, as parts of them.
UNKNOWN_PART = 0.2
_UNKNOWN_SLIP = 0.3


def negligible_torque(backlash: np.ndarray, damping: np.ndarray) -> np.ndarray:
    """Return the torques that count as none [N m], shape of the arguments.

    In the backlash d e' = T: crossing it takes 2 B d / T, with such a torque a second.  A gear with less
    at rest is free: what it does is decided by inertia, and by how the motion came there.

    Args:
        backlash: Half width B of the backlash [rad], any shape.
        damping: Damping d [N m s/rad], shape of `backlash`.

    Example:
        >>> negligible_torque(np.array([1e-4, 0.0]), np.array([1e4, 1e4]))
        array([2.e+00, 1.e-06])
    """
    limit: np.ndarray = np.maximum(2.0 * backlash * damping / _LONG, SETTINGS.neutral_torque)
    return limit


def backlash_reversals(
    spacing: float, torque: np.ndarray, backlash: np.ndarray, damping: np.ndarray
) -> np.ndarray:
    """Return the number of backlash reversals of gears in motion, (...).

    In the backlash d e' = T, and flanks are taken for stiff, so that a torque which turns its sign for a
    moment takes no gear across; 0 for gears without backlash.

    Args:
        spacing: Time between torques [s].
        torque: Torque of the gears [N m], (k, ...).
        backlash: Half width B of the backlash [rad], (...).
        damping: Damping d [N m s/rad], (...), > 0.

    Example:
        >>> torque = np.repeat([5.0, -1.0, 5.0, -5.0], 10)
        >>> backlash_reversals(0.1, torque, np.array(1e-4), np.array(1e4))
        array(1)
    """
    shape = torque.shape[1:]
    changes, rows = np.empty(shape, dtype=np.int64), torque.reshape(len(torque), -1)
    widths, dampings = (np.broadcast_to(v, shape).ravel() for v in (backlash, damping))
    arrays = (
        numbers("torques", rows, rows.shape),
        numbers("backlash", widths, (changes.size,)),
        numbers("damping", dampings, (changes.size,)),
    )
    loaded_library().er_backlash_reversals(
        ctypes.c_int64(len(rows)),
        ctypes.c_int64(changes.size),
        ctypes.c_double(spacing),
        *map(address, (*arrays, changes)),
    )
    return changes


def margin(torque: np.ndarray) -> np.ndarray:
    """Return by how much torques stay clear of zero [N m], (...).

    Negative where they change sign: minus the smallest preload, of either sign, that holds the gear on
    one flank all the way.

    Args:
        torque: Torque of the gears [N m], (k, ...).

    Example:
        >>> margin(np.array([[3.0, -1.0], [5.0, 4.0]]))
        array([ 3., -1.])
    """
    clear: np.ndarray = np.maximum(torque.min(axis=0), -torque.max(axis=0))
    return clear


def backlash_error(backlash: np.ndarray, lever: np.ndarray) -> np.ndarray:
    """Return the error of the tool at rest behind a backlash reversal by a backlash 20 % off [m].

    0.2 of the whole backlash 2 B, times how far the tool moves with the gear: to compare gears and
    settings by.  In motion it is off by several times as much (`coupling.check.robot_findings`).

    Args:
        backlash: Half width B of the backlash [rad], any shape.
        lever: Displacement of the TCP by the gear's wind_up, |J| [m/rad], the same shape.
    """
    error: np.ndarray = UNKNOWN_PART * 2.0 * backlash * lever
    return error


def hysteresis_error(
    slip_torque: np.ndarray, stiffness: np.ndarray, lever: np.ndarray
) -> np.ndarray:
    """Return the error of the tool at rest behind a reversal by slip torques 30 % off [m].

    Under one torque, all elements slipping at F together, the wind-up differs by 2 F / k from side to
    side; 0.3 of it, times how far the tool moves with the gear.

    Args:
        slip_torque: Slip torque F of all elements of the gear [N m], any shape.
        stiffness: Stiffness k of the gear beside them [N m/rad], the same shape.
        lever: Displacement of the TCP by the gear's wind-up, |J| [m/rad], the same shape.
    """
    error: np.ndarray = _UNKNOWN_SLIP * 2.0 * slip_torque / stiffness * lever
    return error
