"""Motion of the robots' drives over time: what a command becomes in a simulation; and of motors."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from coupling.path.time_axis import common_time, require_history
from elastic_robot.trajectory import Trajectory


@dataclass(frozen=True)
class JointPath:
    """Motion of the drives over time, on rows of its own.

    With rates and accelerations it is the quintic Hermite spline of its rows, else the C2 cubic spline
    through them with zero rate at both ends, as the FMU's `trajectory` is.

    Attributes:
        time: Rising times [s], (n,).
        q: Angles of every robot [rad], (n, joints) each.
        qd, qdd: Rates [rad/s], accelerations [rad/s^2], (n, joints) each; both empty for angles alone.

    Raises:
        ValueError: As for ToolPath, or if only one of rates and accelerations is given.
    """

    time: np.ndarray
    q: tuple[np.ndarray, ...]
    qd: tuple[np.ndarray, ...] = ()
    qdd: tuple[np.ndarray, ...] = ()

    def __post_init__(self) -> None:
        if len(self.qd) != len(self.qdd) or len(self.qd) not in (0, len(self.q)):
            raise ValueError(
                f"joint path: expected rates and accelerations of {len(self.q)} robots, or neither, got"
                f" {len(self.qd)} and {len(self.qdd)}"
            )
        for values in (*self.q, *self.qd, *self.qdd):
            require_history(self.time, values, "joint path")

    @classmethod
    def of_robots(cls, motions: Sequence[JointPath]) -> JointPath:
        """Return the motion of several robots that move at the same time."""
        time = common_time(motions, "joint path")
        q, qd, qdd = (
            tuple(values for motion in motions for values in getattr(motion, name))
            for name in ("q", "qd", "qdd")
        )
        return cls(time, q, qd, qdd)

    @property
    def robots(self) -> tuple[JointPath, ...]:
        """Motion of every robot by itself."""
        return tuple(
            JointPath(self.time, self.q[i : i + 1], self.qd[i : i + 1], self.qdd[i : i + 1])
            for i in range(len(self.q))
        )

    @property
    def trajectory(self) -> Trajectory:
        """Motion of the only robot at any time, as its FMU reads it.

        Raises:
            TrajectoryError: If its rows are closer or larger than the model takes.
        """
        (q,), (qd,), (qdd,) = self.q, self.qd or (None,), self.qdd or (None,)
        return Trajectory(self.time, q, qd, qdd)

    @property
    def columns(self) -> dict[str, np.ndarray]:
        """Columns q1.. [rad] and, if any, qd1.., qdd1.. of the first robot, by name, (n,) each."""
        blocks = {"q": self.q, "qd": self.qd, "qdd": self.qdd}
        return {
            f"{name}{i + 1}": values[0][:, i]
            for name, values in blocks.items()
            if values
            for i in range(values[0].shape[1])
        }


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
