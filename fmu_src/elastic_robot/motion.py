"""The robot under prescribed drives and a held wrench, as the system that the stepper integrates."""

from __future__ import annotations

from typing import Protocol

import numpy as np

from elastic_robot.dynamics import Dynamics
from elastic_robot.torque_curves import TorqueCurve


class Drives(Protocol):
    """Motion of the drives over time."""

    def at(self, times: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """Return q, q', q'' at times (k,), each (k, n)."""
        ...


class DrivenMotion:
    """M theta'' + h - J^T w + S(x) + d x' = 0 along given drives.

    Args:
        dynamics: Forces of the robot.
        curve: Torque curve S.
        damping: d [N m s/rad], (m,).
        drives: Motion of the drives.
        wrench: On the robot at the TCP, base axes, held, (6,).
    """

    def __init__(
        self,
        dynamics: Dynamics,
        curve: TorqueCurve,
        damping: np.ndarray,
        drives: Drives,
        wrench: np.ndarray,
    ) -> None:
        self._dynamics = dynamics
        self._curve = curve
        self._damping = damping
        self._drives = drives
        self._wrench = wrench if np.any(wrench) else None
        self.half_width = curve.half_width

    def begin(self, times: np.ndarray, region: np.ndarray) -> None:
        """Evaluate the drives at the times of a step and take the branches of the curve."""
        chain = self._dynamics.chain
        self._drive = np.zeros((3, len(times), chain.model.nv))
        self._drive[:, :, chain.drive] = self._drives.at(times)
        self._branch = self._curve.in_region(region)

    def residual(self, motion: np.ndarray, first_row: int) -> np.ndarray:
        """Return the sum of all torques on the elastic coordinates [N m], (k, m)."""
        chain = self._dynamics.chain
        whole = motion @ chain.selection
        whole += self._drive[:, first_row : first_row + motion.shape[1]]
        load = self._dynamics.loads(whole[0], whole[1], whole[2], self._wrench)
        torque: np.ndarray = self._branch.torque(motion[0]) + self._damping * motion[1]
        return torque + load

    def matrices(self, x: np.ndarray, row: int) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """Return mass matrix, damping and stiffness of the branch, at the time of a row."""
        theta = self._drive[0, row] + x @ self._dynamics.chain.selection
        return self._dynamics.mass_matrix(theta), self._damping, self._branch.slope(x)
