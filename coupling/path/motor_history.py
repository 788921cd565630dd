"""What the motors of one robot do over time."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np


@dataclass(frozen=True)
class MotorHistory:
    """Torques and motion of the motors of a robot, seen at their gears' output.

    Attributes:
        joints: Joints that have the m motors, from 0.
        time: Rising [s], (n,).
        torque: Their torques [N m], (n, m).
        angle, rate: Its angle [rad] and rate [rad/s], (n, m).
    """

    joints: tuple[int, ...]
    time: np.ndarray
    torque: np.ndarray
    angle: np.ndarray
    rate: np.ndarray

    def of(self, motor: int) -> MotorHistory:
        """Return that of one motor, from 0 among the m."""
        torque, angle, rate = (v[:, [motor]] for v in (self.torque, self.angle, self.rate))
        return MotorHistory((self.joints[motor],), self.time, torque, angle, rate)

    def every(self, step: int) -> MotorHistory:
        """Return every so many rows."""
        rows = slice(None, None, step)
        return replace(
            self,
            time=self.time[rows],
            torque=self.torque[rows],
            angle=self.angle[rows],
            rate=self.rate[rows],
        )
