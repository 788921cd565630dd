"""How a motor under its servo gives way to more friction."""

from __future__ import annotations

import numpy as np
from scipy.signal import cont2discrete, lfilter

from coupling.inverse.servo import presliding
from elastic_robot.gear_parts import Drive


def moved_by_friction(
    drive: Drive, time: np.ndarray, angle: np.ndarray, rate: np.ndarray
) -> np.ndarray:
    """Return how a motor's angle follows the log factor of its friction under a command [rad], (n,).

    The friction's element turns with the motor nearly as it does without the change, and its torque
    df = F (1 - c (1 - exp(-(q'/v)^2))) s / a is a load of the servo's loop:

        (J p^3 + (Kp + b) p^2 + (Kp Kv + Ki) p + Ki Kv) dq = -p df,    p = d/dt.

    Args:
        drive: The drive.
        time: Even times [s], (n,).
        angle, rate: The motor's angle and rate [rad, rad/s], (n,).

    Example:
        >>> drive = Drive(inertia=1.0, position_gain=20.0, rate_gain=100.0, friction=40.0)
        >>> time = np.arange(0.0, 2.0, 1e-3)
        >>> moved = moved_by_friction(drive, time, 0.1 * time, np.full(len(time), 0.1))
        >>> round(float(moved[-1]), 6)  # -F / (Kp Kv) without an integral
        -0.02
    """
    torque = friction_at_rest(drive, angle, rate)
    kp, ki, kv = drive.rate_gain, drive.integral_gain, drive.position_gain
    loop = [drive.inertia, kp + drive.viscous, kp * kv + ki, ki * kv]
    # Without an integral both sides have a factor p.
    by = ([-1.0], loop[:3]) if ki == 0.0 else ([-1.0, 0.0], loop)
    numerator, denominator, _ = cont2discrete(by, float(time[1] - time[0]), "foh")
    moved: np.ndarray = lfilter(np.ravel(numerator), denominator, torque)
    return moved


def friction_at_rest(drive: Drive, angle: np.ndarray, rate: np.ndarray) -> np.ndarray:
    """Return a motor's friction without what is viscous or grows with the load [N m], (n,).

    It is the derivative of its torque by the log factor of the friction, but for what its rotor does.

    Args:
        drive: The drive.
        angle, rate: The motor's angle and rate [rad, rad/s], (n,).
    """
    part = presliding(angle, drive.slip_angle)
    torque: np.ndarray = drive.friction_torque(drive.friction, part, rate, np.zeros(1))
    return torque - drive.viscous * rate
