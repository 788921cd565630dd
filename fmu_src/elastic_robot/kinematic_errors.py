"""Kinematic errors of the gears: from motors' angles q to the angles u at their gears' outputs.

    u = q + eps(q)          eps(q) = sum a sin(n q + p)
    u' = (1 + eps') q'      u'' = (1 + eps') q'' + eps'' q'^2

The chain, its gears' wind-up and its equation of motion know u alone.  A motor feels its gear's torque T
as (1 + eps'(q)) T: what it does is what the gear takes, T u' = (1 + eps') T q'.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np

from elastic_robot.description import Robot


@dataclass(frozen=True)
class KinematicErrors:
    """Sines of all gears' kinematic errors, s of them.

    Attributes:
        joint_count: Number of joints n.
        joint: Number of the joint of each, from 0, (s,).
        amplitude: Amplitude a [rad], > 0, (s,).
        order: Number n of its periods in a turn of the gear's output, > 0, (s,).
        phase: Phase p at q = 0 [rad], (s,).

    Example:
        >>> one = np.ones(1)
        >>> errors = KinematicErrors(1, np.zeros(1, dtype=int), 1e-4 * one, 100.0 * one, 0.0 * one)
        >>> errors.at_output(np.array([[0.0], [2.0], [0.0]])).T.round(9).tolist()  # 1 % faster there
        [[0.0, 2.02, 0.0]]
    """

    joint_count: int
    joint: np.ndarray
    amplitude: np.ndarray
    order: np.ndarray
    phase: np.ndarray

    @classmethod
    def of(cls, robot: Robot) -> KinematicErrors:
        """Return the sines of a robot's description."""
        sines = [(i, e) for i, joint in enumerate(robot.joints) for e in joint.kinematic_error]
        numbers = np.array([(e.amplitude, e.order, e.phase) for _, e in sines], dtype=float)
        joint = np.array([i for i, _ in sines], dtype=int)
        return cls(len(robot.joints), joint, *numbers.reshape(-1, 3).T)

    @property
    def count(self) -> int:
        """Number of sines s."""
        return len(self.joint)

    def derivatives(self, q: np.ndarray) -> np.ndarray:
        """Return eps, eps', eps'', eps''' [rad, 1, 1/rad, 1/rad^2] at q (..., n) [rad], (4, ..., n)."""
        turned = self.order * q[..., self.joint] + self.phase
        sine, cosine = self.amplitude * np.sin(turned), self.amplitude * np.cos(turned)
        n = self.order
        sines = np.stack([sine, n * cosine, -(n**2) * sine, -(n**3) * cosine])
        derivatives: np.ndarray = sines @ self._owner
        return derivatives

    def slope(self, q: np.ndarray) -> np.ndarray:
        """Return du/dq = 1 + eps' [1] at q (..., n) [rad], (..., n)."""
        return 1.0 + self.derivatives(q)[1]

    def at_output(self, drives: np.ndarray) -> np.ndarray:
        """Return u, u', u'' [rad, rad/s, rad/s^2] of q, q', q'', (3, ..., n) each."""
        if self.count == 0:
            return drives
        q, rate, acceleration = drives
        eps, slope, bend, _ = self.derivatives(q)
        rise = 1.0 + slope
        return np.stack([q + eps, rise * rate, rise * acceleration + bend * rate**2])

    def gradient(self, drives: np.ndarray) -> np.ndarray:
        """Return the derivatives of u, u', u'' by q, q', q'' of one state or of k.

        Args:
            drives: q, q', q'' [rad, rad/s, rad/s^2], (3, n) or (3, k, n).

        Returns:
            Rows u of all joints, then u', then u''; columns likewise; (3 n, 3 n) or (k, 3 n, 3 n).
        """
        q, rate, acceleration = drives
        _, slope, bend, third = self.derivatives(q)
        rise, none = 1.0 + slope, np.zeros_like(q)
        # Entry i, j is the derivative of row i by column j, of each joint by its own alone.
        by = np.array(
            [
                [rise, none, none],
                [bend * rate, rise, none],
                [bend * acceleration + third * rate**2, 2.0 * bend * rate, rise],
            ]
        )
        n = self.joint_count
        each = np.einsum("ij...a,ab->...iajb", by, np.eye(n))
        return each.reshape(*q.shape[:-1], 3 * n, 3 * n)

    @cached_property
    def _owner(self) -> np.ndarray:
        """Whether a sine is a joint's, 1 or 0, (s, n)."""
        return np.eye(self.joint_count)[self.joint]
