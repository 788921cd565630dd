"""What a path asks of the joints of a robot that does not give way."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy.interpolate import CubicSpline

from coupling.inverse.joint_limits import JointLimits

# Parts of the time between two samples at whose ends rates are looked at.
_PARTS = 4


@dataclass(frozen=True)
class JointDemand:
    """What a path asks of one joint; a limit that its robot file does not know is infinite.

    Attributes:
        joint: Number, from 1.
        lowest, highest: Angles [rad].
        lower, upper: Limits of the angle [rad].
        rate, rate_limit: Largest rate and its limit [rad/s].
        acceleration, acceleration_limit: Largest acceleration and its limit [rad/s^2].
    """

    joint: int
    lowest: float
    highest: float
    lower: float
    upper: float
    rate: float
    rate_limit: float
    acceleration: float
    acceleration_limit: float

    @property
    def margin(self) -> float:
        """Smallest distance from the limits of the angle [rad]; negative beyond them."""
        return min(self.lowest - self.lower, self.upper - self.highest)

    @property
    def beyond(self) -> list[str]:
        """Names of what passes its limit."""
        asked = {
            "angle": self.margin < 0.0,
            "rate": self.rate > self.rate_limit,
            "acceleration": self.acceleration > self.acceleration_limit,
        }
        return [name for name, passes in asked.items() if passes]


def joint_demands(time: np.ndarray, q: np.ndarray, limits: JointLimits) -> tuple[JointDemand, ...]:
    """Return what a motion asks of the joints: the C2 cubic spline of its samples, at rest at both ends.

    Args:
        time: Rising [s], (n,).
        q: Angles [rad], (n, joints).
        limits: Those of the joints.

    Example:
        >>> time = np.linspace(0.0, 1.0, 101)
        >>> swing = (0.5 - 0.5 * np.cos(2.0 * np.pi * time))[:, None]
        >>> free = JointLimits(*np.array([[-1.0], [2.0], [np.inf], [np.inf]]))
        >>> (asked,) = joint_demands(time, swing, free)
        >>> round(asked.rate, 3), round(asked.acceleration, 2), asked.margin
        (3.142, 19.75, 1.0)
    """
    motion = CubicSpline(time, q, bc_type="clamped")
    between = time[:-1, None] + np.diff(time)[:, None] * np.arange(_PARTS) / _PARTS
    rate = np.abs(motion(between.ravel(), 1)).max(axis=0)
    acceleration = np.abs(motion(time, 2)).max(axis=0)
    angles = (q.min(axis=0), q.max(axis=0), limits.lower, limits.upper)
    columns = (*angles, rate, limits.rate, acceleration, limits.acceleration)
    rows = np.column_stack(columns).tolist()
    return tuple(JointDemand(number, *row) for number, row in enumerate(rows, start=1))
