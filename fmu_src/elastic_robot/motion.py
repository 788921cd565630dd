"""The robot under prescribed drives and a load, as the system that the stepper integrates."""

from __future__ import annotations

from dataclasses import replace
from typing import Protocol

import numpy as np

from elastic_robot.dynamics import Dynamics
from elastic_robot.plane_contact import NO_CONTACT
from elastic_robot.tool_load import Acting, Load
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
        self._acting: Acting | None = None
        self.half_width = curve.half_width
        self.contacting = False

    def hold(self, drives: Drives, load: Load, start: float) -> None:
        """Set the drives, and the load of the communication step that starts at a time [s]."""
        self._drives, self._load, self._start = drives, load, start
        loaded = load.is_sprung or load.wrench.any() or not load.is_even
        self._acting = load.at(0.0) if loaded else None
        self.contacting = load.contact.holds

    def next_kink(self, time: float) -> float:
        """Return the first time after `time` at which the drives' third derivative jumps."""
        return self._drives.next_kink(time, self._jump)

    def depths(
        self, times: np.ndarray, x: np.ndarray, v: np.ndarray
    ) -> tuple[np.ndarray, np.ndarray]:
        """Return depth [m] and approach [m/s] of the contact, (k,), at times (k,) and states (k, m)."""
        chain = self._dynamics.chain
        drive = self._drives.at(times) @ chain.drive_selection
        theta, rate = (rows @ chain.selection + drive[k] for k, rows in enumerate((x, v)))
        depth, approach, _ = self._dynamics.contact_state(
            theta, rate, self._load.at(times - self._start)
        )
        return depth, approach

    def begin(self, times: np.ndarray, region: np.ndarray, touching: bool = False) -> None:
        """Evaluate the drives at the times of a step and take the branches of curve and contact."""
        self._drive = self._drives.at(times) @ self._dynamics.chain.drive_selection
        if self._load.is_sprung or not self._load.is_even:
            self._acting = self._load.at(times - self._start)
            if self.contacting:
                self._acting = replace(self._acting, touching=touching)
        if region is not self._region:
            self._branch, self._region = self._curve.in_region(region), region

    def residual(self, motion: np.ndarray, rows: slice) -> np.ndarray:
        """Return the sum of all torques on the elastic coordinates [N m], (k, m)."""
        chain, count = self._dynamics.chain, motion.shape[1]
        whole = motion.reshape(3 * count, -1).dot(chain.selection).reshape(3, count, -1)
        whole += self._drive[:, rows]
        acting = None if self._acting is None else self._acting.of(rows)
        torque = self._dynamics.loads(whole[0], whole[1], whole[2], acting)
        torque += self._branch.torque(motion[0])
        torque += self._damping * motion[1]
        return torque

    def matrices(
        self, x: np.ndarray, v: np.ndarray, row: int
    ) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """Return mass matrix, damping and stiffness, of spring and contact too, at a row's time."""
        theta = self._drive[0, row] + x @ self._dynamics.chain.selection
        stiffness = np.diag(self._branch.slope(x))
        if self._acting is not None and self._acting.touching:
            rate = self._drive[1, row] + v @ self._dynamics.chain.selection
            acting = self._acting.of(row)
            of_contact, damping = self._dynamics.contact_matrices(theta, rate, acting)
            mass = self._dynamics.mass_matrix(theta)
            return mass, np.diag(self._damping) + damping, stiffness + of_contact
        if self._acting is not None and self._acting.has_spring:
            acting = self._acting
            if self.contacting:
                acting = replace(acting.of(row), contact=NO_CONTACT)
            stiffness += self._dynamics.support(theta, acting)
        return self._dynamics.mass_matrix(theta), self._damping, stiffness
