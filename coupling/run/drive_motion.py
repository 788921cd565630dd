"""What a motion asks of every drive."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from coupling.inverse.joint_limits import JointLimits
from coupling.path.histories import JointPath

# Times per row at which a command is looked at.
_BETWEEN = 8


@dataclass(frozen=True)
class DriveMotion:
    """What a motion asks of one drive, between its rows as well.

    Attributes:
        joint: Number, from 1.
        lowest, highest: Range of the angle [rad].
        lower_limit, upper_limit: What the joint allows of it [rad], or None.
        rate: Largest |q'| [rad/s].
        rate_time: Instant of it [s].
        rate_limit: Highest rate that the joint allows [rad/s], or None.
        acceleration: Largest |q''| [rad/s^2].
        acceleration_time: Instant of it [s].
        acceleration_limit: Highest acceleration that joint and controller allow [rad/s^2], or None.
    """

    joint: int
    lowest: float
    highest: float
    lower_limit: float | None
    upper_limit: float | None
    rate: float
    rate_time: float
    rate_limit: float | None
    acceleration: float
    acceleration_time: float
    acceleration_limit: float | None

    @property
    def margin(self) -> float:
        """Smallest distance from the limits of the angle [rad]; negative beyond them, else infinite."""
        below = np.inf if self.lower_limit is None else self.lowest - self.lower_limit
        above = np.inf if self.upper_limit is None else self.upper_limit - self.highest
        return min(below, above)

    @property
    def beyond(self) -> list[str]:
        """Names of what passes its limit."""
        rate, most = self.rate_limit, self.acceleration_limit
        asked = {
            "angle": self.margin < 0.0,
            "rate": rate is not None and self.rate > rate,
            "acceleration": most is not None and self.acceleration > most,
        }
        return [name for name, passes in asked.items() if passes]


def drive_motions(command: JointPath, limits: JointLimits) -> tuple[DriveMotion, ...]:
    """Return what the motion of one robot asks of its drives.

    Args:
        command: Motion of the drives; at rest at both ends where it has no rates.
        limits: What they can do.

    Example:
        >>> rows, none = np.array([0.0, 1.0]), np.array([np.inf])
        >>> turn = JointPath(rows, (np.array([[0.0], [1.0]]),))
        >>> (drive,) = drive_motions(turn, JointLimits(-none, none, none, none))
        >>> drive.rate, drive.rate_time, drive.acceleration
        (1.5, 0.5, 6.0)
    """
    rows = len(command.time) - 1
    time = np.interp(np.arange(_BETWEEN * rows + 1) / _BETWEEN, np.arange(rows + 1), command.time)
    q, qd, qdd = command.trajectory.at(time)
    qd, qdd = np.abs(qd), np.abs(qdd)
    return tuple(
        DriveMotion(
            joint=i + 1,
            lowest=float(q[:, i].min()),
            highest=float(q[:, i].max()),
            lower_limit=_limit(limits.lower[i]),
            upper_limit=_limit(limits.upper[i]),
            rate=float(qd[:, i].max()),
            rate_time=float(time[qd[:, i].argmax()]),
            rate_limit=_limit(limits.rate[i]),
            acceleration=float(qdd[:, i].max()),
            acceleration_time=float(time[qdd[:, i].argmax()]),
            acceleration_limit=_limit(limits.acceleration[i]),
        )
        for i in range(q.shape[1])
    )


def _limit(value: float) -> float | None:
    """Return a limit, None where there is none."""
    return float(value) if np.isfinite(value) else None
