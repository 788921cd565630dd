"""What a command asks of drives and their motors."""

from __future__ import annotations

from typing import ClassVar

import numpy as np

from coupling.results.base import ResultPart


class MotorLoad(ResultPart):
    """What a motion asks of the motor of one drive, seen at its gear's output.

    Attributes:
        torque: Largest torque that it needs, to either side [N m].
        torque_time: Instant of it [s].
        limit: Largest torque that it has [N m], or None.
        reversals: Number of times that its friction slips the other way than before.
        presliding: Share of the time in which its friction sticks: at rest, and behind reversals.
    """

    torque: float
    torque_time: float
    limit: float | None
    reversals: int
    presliding: float


class DriveMotion(ResultPart):
    """What a motion asks of one drive, between its rows as well.

    Attributes:
        joint: Number, from 1.
        lowest, highest: Range of the angle [rad].
        lower_limit, upper_limit: Limits of the joint's angle [rad], or None.
        rate: Largest |q'| [rad/s].
        rate_time: Instant of it [s].
        rate_limit: Highest rate that the joint allows [rad/s], or None.
        acceleration: Largest |q''| [rad/s^2].
        acceleration_time: Instant of it [s].
        acceleration_limit: Highest acceleration that joint and controller allow [rad/s^2], or None.
        motor: Demands on the motor; None where there is none, or it was not looked at.
    """

    sparse: ClassVar = ("motor",)

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
    motor: MotorLoad | None = None

    @property
    def margin(self) -> float:
        """Smallest distance from the limits of the angle [rad]; negative beyond them, else infinite."""
        below = np.inf if self.lower_limit is None else self.lowest - self.lower_limit
        above = np.inf if self.upper_limit is None else self.upper_limit - self.highest
        return min(below, above)

    @property
    def exceeded(self) -> list[str]:
        """Names of what exceeds its limit."""
        rate, most = self.rate_limit, self.acceleration_limit
        exceeded = {
            "angle": self.margin < 0.0,
            "rate": rate is not None and self.rate > rate,
            "acceleration": most is not None and self.acceleration > most,
        }
        return [name for name, is_exceeded in exceeded.items() if is_exceeded]


class DriveResult(ResultPart):
    """What the command asks of a drive."""

    sparse: ClassVar = (
        *("motor_torque_Nm", "motor_torque_time_s", "motor_torque_limit_Nm"),
        *("motor_reversals", "motor_presliding_share"),
    )

    robot: str
    joint: int
    range_rad: tuple[float, float]
    range_limit_rad: tuple[float | None, float | None]
    rate_rad_s: float
    rate_time_s: float
    rate_limit_rad_s: float | None
    acceleration_rad_s2: float
    acceleration_time_s: float
    acceleration_limit_rad_s2: float | None
    motor_torque_Nm: float | None = None
    motor_torque_time_s: float | None = None
    motor_torque_limit_Nm: float | None = None
    motor_reversals: int | None = None
    motor_presliding_share: float | None = None

    @classmethod
    def of(cls, drive: DriveMotion, robot: str) -> DriveResult:
        """Return what the command asks of a drive of a robot, by its name."""
        motor = drive.motor
        return cls(
            robot=robot,
            joint=drive.joint,
            range_rad=(drive.lowest, drive.highest),
            range_limit_rad=(drive.lower_limit, drive.upper_limit),
            rate_rad_s=drive.rate,
            rate_time_s=drive.rate_time,
            rate_limit_rad_s=drive.rate_limit,
            acceleration_rad_s2=drive.acceleration,
            acceleration_time_s=drive.acceleration_time,
            acceleration_limit_rad_s2=drive.acceleration_limit,
            motor_torque_Nm=None if motor is None else motor.torque,
            motor_torque_time_s=None if motor is None else motor.torque_time,
            motor_torque_limit_Nm=None if motor is None else motor.limit,
            motor_reversals=None if motor is None else motor.reversals,
            motor_presliding_share=None if motor is None else motor.presliding,
        )


class CommandResult(ResultPart):
    """Demands on the drives."""

    rows: int
    drives: tuple[DriveResult, ...]
