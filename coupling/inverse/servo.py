"""The command of a servo for a desired motion of its motor: torque, then command.

A drive (`elastic_robot.gear_parts.Drive`) whose motor is to follow q(t) while its gear carries T,

    tau = J q'' - (1 + eps'(q)) T + f(q, q', T),                                                 (1)
    Kp w + z = tau,   z' = Ki w,                                                                 (2)
    kff delta' = -Kv delta + w + (1 - kff) q',   q_cmd = q + delta,                              (3)

is inverted forwards in time: the friction's element follows q, (2) is a low-pass of time constant
Kp / Ki for z, (3) one of kff / Kv for the following error delta, or none for kff = 0.  So there is one
answer to a start, and errors die out.  A motor starts at its command and its rate, with the torque that
moves it so: delta = delta' = 0.
"""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np

from coupling.inverse.gear_elements import GearElements
from coupling.inverse.lag import lagged
from elastic_robot.drive import Drive


@dataclass(frozen=True)
class MotorMotion:
    """Motion of a motor at even times, seen at the gear's output.

    Attributes:
        time: Times [s], (n,).
        angle: q [rad], (n,).
        rate: q' [rad/s], (n,).
        acceleration: q'' [rad/s^2], (n,).
        gear_torque: Torque of the gear on its link, -T [N m], (n,): the FMU's output `gear_torque`.
        held: The same where the robot is held at rest at the first time, as a simulation starts [N m].
        slope: 1 + eps' of the gear, by which it feels that torque [1], (n,) or (1,).
    """

    time: np.ndarray
    angle: np.ndarray
    rate: np.ndarray
    acceleration: np.ndarray
    gear_torque: np.ndarray
    held: float
    slope: np.ndarray = field(default_factory=lambda: np.ones(1))


@dataclass(frozen=True)
class ServoMotion:
    """Command of a servo and torque of its motor at the times of a `MotorMotion`.

    Attributes:
        angle: q_cmd [rad], (n,).
        rate: q_cmd' [rad/s], (n,).
        torque: tau [N m], (n,).
    """

    angle: np.ndarray
    rate: np.ndarray
    torque: np.ndarray


def presliding(angle: np.ndarray, slip_angle: float, start: float = 0.0) -> np.ndarray:
    """Return s / a of the stop element of a motor's friction along its angle, -1 to 1, (n,).

    Args:
        angle: Angle of the motor [rad], (n,).
        slip_angle: Angle a over which friction builds up [rad].
        start: s / a in the first row.

    Example:
        >>> presliding(np.array([0.0, 1.0, 3.0, 2.5]), 2.0).tolist()
        [0.0, 0.5, 1.0, 0.75]
    """
    stop = GearElements(np.ones(1), np.array([slip_angle]))
    part: np.ndarray = stop.along(angle, np.array([start * slip_angle]))[:, 0] / slip_angle
    return part


def motor_torque(drive: Drive, motion: MotorMotion) -> np.ndarray:
    """Return the torque tau that a motor needs, eq. (1) [N m], (n,); its friction starts unloaded."""
    part = presliding(motion.angle, drive.slip_angle)
    friction = drive.friction_torque(drive.friction, part, motion.rate, motion.gear_torque)
    felt = motion.slope * motion.gear_torque
    torque: np.ndarray = drive.inertia * motion.acceleration + felt + friction
    return torque


def servo_motion(drive: Drive, motion: MotorMotion) -> ServoMotion:
    """Return the command under which a motor moves as wanted, eqs. (2) and (3).

    Args:
        drive: The drive; its limit of torque is not looked at.
        motion: The motor's motion, so dense that torque and rate are straight in between.

    Example:
        >>> drive = Drive(inertia=1.0, position_gain=20.0, rate_gain=100.0, integral_gain=1e3,
        ...               feed_forward=0.0)
        >>> time = np.linspace(0.0, 1.0, 101)
        >>> motion = MotorMotion(time, 0.1 * time, np.full(101, 0.1), *np.zeros((2, 101)), 0.0)
        >>> servo_motion(drive, motion).angle[-1].round(6).item()  # v / Kv ahead
        0.105
    """
    step = float(motion.time[-1] - motion.time[0]) / (len(motion.time) - 1)
    torque, rate = motor_torque(drive, motion), motion.rate
    kp, ki, kv, kff = drive.rate_gain, drive.integral_gain, drive.position_gain, drive.feed_forward
    # Where a gear comes to a flank q'' jumps.  Its integral alone counts: z = J Ki/Kp q' + ..., and
    # delta = J/(Kp kff) q' + ... likewise, so that the rests' equations have q' in the place of q''.
    rest = torque - drive.inertia * motion.acceleration
    # At the start w is that of a command which is the motor's motion, the gear's torque that at rest.
    start = torque[0] + motion.slope[0] * (motion.held - motion.gear_torque[0])
    start -= kp * (kff - 1.0) * rate[0]
    by_rate = drive.inertia * ki / kp
    integral = np.full(len(torque), start)
    if ki > 0.0:
        moved = by_rate * rate
        integral = moved + lagged(rest - moved, step, kp / ki, start - moved[0])
    wanted = (torque - integral) / kp + (1.0 - kff) * rate
    if kff == 0.0:
        ahead = wanted / kv
        growth = np.append(0.0, np.gradient(ahead, step)[1:])
        return ServoMotion(motion.angle + ahead, rate + growth, torque)
    moved = drive.inertia / (kp * kff) * rate
    slow = (rest - integral) / kp + (1.0 - kff) * rate
    ahead = moved + lagged(slow / kv - moved, step, kff / kv, -moved[0])
    return ServoMotion(motion.angle + ahead, rate + (wanted - kv * ahead) / kff, torque)
