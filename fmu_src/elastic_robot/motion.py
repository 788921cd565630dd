"""The robot under prescribed drives and a held wrench, as the system that the stepper integrates."""

from __future__ import annotations

from typing import Protocol

import numpy as np

from elastic_robot.dynamics import Dynamics
from elastic_robot.torque_curves import TorqueCurve


class Drives(Protocol):
    """Motion of the drives over time."""

    def at(self, times: np.ndarray) -> np.ndarray:
        """Return q, q', q'' at times (k,), (3, k, n)."""
        ...

    def next_kink(self, time: float, jump: float) -> float:
        """Return the first time after `time` of a jump of the third derivative.

        Jumps up to `jump` [rad/s^3] do not count; infinity if there is none.
        """
        ...


class DrivenMotion:
    """M theta'' + h - J^T w + S(x) + d x' = 0 along given drives.

    Args:
        dynamics: Forces of the robot.
        curve: Torque curve S.
        damping: d [N m s/rad], (m,).
        jump: A jump of the drives' third derivative up to this one may be stepped over [rad/s^3].
    """

    def __init__(
        self, dynamics: Dynamics, curve: TorqueCurve, damping: np.ndarray, jump: float
    ) -> None:
        self._dynamics = dynamics
        self._curve = curve
        self._damping = damping
        self._jump = jump
        self._region: np.ndarray | None = None
        self.half_width = curve.half_width

    def hold(self, drives: Drives, wrench: np.ndarray) -> None:
        """Set the drives, and the wrench on the robot at the TCP, base axes, (6,), of what follows."""
        self._drives = drives
        self._wrench = wrench if np.any(wrench) else None

    def next_kink(self, time: float) -> float:
        """Return the first time after `time` at which the drives' third derivative jumps."""
        return self._drives.next_kink(time, self._jump)

    def begin(self, times: np.ndarray, region: np.ndarray) -> None:
        """Evaluate the drives at the times of a step and take the branches of the curve."""
        self._drive = self._drives.at(times) @ self._dynamics.chain.drive_selection
        if region is not self._region:
            self._branch, self._region = self._curve.in_region(region), region

    def residual(self, motion: np.ndarray, rows: slice) -> np.ndarray:
        """Return the sum of all torques on the elastic coordinates [N m], (k, m)."""
        chain, count = self._dynamics.chain, motion.shape[1]
        whole = motion.reshape(3 * count, -1).dot(chain.selection).reshape(3, count, -1)
        whole += self._drive[:, rows]
        torque = self._dynamics.loads(whole[0], whole[1], whole[2], self._wrench)
        torque += self._branch.torque(motion[0])
        torque += self._damping * motion[1]
        return torque

    def matrices(self, x: np.ndarray, row: int) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """Return mass matrix, damping and stiffness of the branch, at the time of a row."""
        theta = self._drive[0, row] + x @ self._dynamics.chain.selection
        return self._dynamics.mass_matrix(theta), self._damping, self._branch.slope(x)
