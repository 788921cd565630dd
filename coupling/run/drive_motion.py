"""What a motion asks of every drive."""

from __future__ import annotations

import numpy as np

from coupling.inverse.joint_limits import JointLimits
from coupling.path.joint_path import JointPath
from coupling.results.drive_result import DriveMotion
from coupling.run.check import Check, CheckedCommand
from coupling.run.simulated_motor_torques import MOTOR_TORQUES

# Times per row at which a command is looked at.
_BETWEEN = 8


def drive_motions(command: JointPath, limits: JointLimits) -> tuple[DriveMotion, ...]:
    """Return what the motion of one robot asks of its drives.

    Args:
        command: Motion of the drives; at rest at both ends where it has no rates.

    Example:
        >>> rows, none = np.array([0.0, 1.0]), np.array([np.inf])
        >>> turn = JointPath(rows, (np.array([[0.0], [1.0]]),))
        >>> (drive,) = drive_motions(turn, JointLimits(-none, none, none, none))
        >>> drive.rate_rad_s, drive.rate_time_s, drive.acceleration_rad_s2
        (1.5, 0.5, 6.0)
    """
    rows = len(command.time) - 1
    time = np.interp(np.arange(_BETWEEN * rows + 1) / _BETWEEN, np.arange(rows + 1), command.time)
    q, qd, qdd = command.trajectory.at(time)
    qd, qdd = np.abs(qd), np.abs(qdd)
    return tuple(
        DriveMotion(
            joint=i + 1,
            range_rad=(float(q[:, i].min()), float(q[:, i].max())),
            range_limit_rad=(_limit(limits.lower[i]), _limit(limits.upper[i])),
            rate_rad_s=float(qd[:, i].max()),
            rate_time_s=float(time[qd[:, i].argmax()]),
            rate_limit_rad_s=_limit(limits.rate[i]),
            acceleration_rad_s2=float(qdd[:, i].max()),
            acceleration_time_s=float(time[qdd[:, i].argmax()]),
            acceleration_limit_rad_s2=_limit(limits.acceleration[i]),
        )
        for i in range(q.shape[1])
    )


def _limit(value: float) -> float | None:
    return float(value) if np.isfinite(value) else None


def _compute(command: CheckedCommand) -> tuple[tuple[DriveMotion, ...], ...]:
    case, demands = command.case, []
    for joints, placed, motor in zip(
        command.correction.joints.robots,
        case.robots,
        command.finding_of(MOTOR_TORQUES),
        strict=True,
    ):
        limits = JointLimits.of(placed.description, case.controller.max_acceleration)
        drives = drive_motions(joints, limits)
        demands.append(drives if motor is None else motor.with_motors(drives))
    return tuple(demands)


DRIVE_MOTION = Check[tuple[tuple[DriveMotion, ...], ...]]("drives", _compute, ())
