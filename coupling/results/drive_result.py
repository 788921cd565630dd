"""What a command asks of drives and their motors."""

from __future__ import annotations

from typing import ClassVar

import numpy as np

from coupling.results.base import ResultPart


class MotorTorque(ResultPart):
    """What a motion asks of the motor of one drive, seen at its gear's output; its limit apart.

    Attributes:
        motor_torque_Nm: Largest torque that it needs, to either side.
        motor_torque_limit_Nm: Largest torque that it has, or None.
        motor_reversals: Number of times that its friction slips the other way than before.
        motor_presliding_share: Share of the time in which its friction sticks: at rest, and behind
            reversals.
    """

    motor_torque_Nm: float
    motor_torque_time_s: float
    motor_torque_limit_Nm: float | None
    motor_reversals: int
    motor_presliding_share: float


class DriveMotion(ResultPart):
    """What a motion asks of one drive, between its rows as well.

    Attributes:
        range_rad: Lowest and highest angle.
        rate_rad_s: Largest |q'|.
        rate_limit_rad_s: Highest rate that the joint allows, or None.
        acceleration_rad_s2: Largest |q''|.
        acceleration_limit_rad_s2: Highest acceleration that joint and controller allow, or None.
        motor_torque_Nm, motor_torque_time_s, motor_torque_limit_Nm, motor_reversals,
            motor_presliding_share: As of `MotorTorque`; None where the joint has no motor, or it was not
            simulated.
    """

    sparse: ClassVar = ("robot", *MotorTorque.model_fields)

    robot: str | None = None
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

    @property
    def margin(self) -> float:
        """Smallest distance from the limits of the angle [rad]; negative beyond them, else infinite."""
        (lowest, highest), (low, high) = self.range_rad, self.range_limit_rad
        return min(
            np.inf if low is None else lowest - low, np.inf if high is None else high - highest
        )

    @property
    def exceeded(self) -> list[str]:
        """Names of what exceeds its limit."""
        rate, most = self.rate_limit_rad_s, self.acceleration_limit_rad_s2
        exceeded = {
            "angle": self.margin < 0.0,
            "rate": rate is not None and self.rate_rad_s > rate,
            "acceleration": most is not None and self.acceleration_rad_s2 > most,
        }
        return [name for name, is_exceeded in exceeded.items() if is_exceeded]


class CommandResult(ResultPart):
    """Demands on the drives."""

    rows: int
    drives: tuple[DriveMotion, ...]
