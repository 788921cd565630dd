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

# Passes of the way back from a gear's output, each of which halves what is left at least, and what is
# left then, over 1 rad and the angle.
_PASSES, _ROUNDING = 60, 2e-16


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

    def of_joint(self, joint: int) -> KinematicErrors:
        """Return those of one joint, from 0, as of a robot that has no other."""
        is_of_joint = self.joint == joint
        none = np.zeros(int(is_of_joint.sum()), dtype=int)
        return KinematicErrors(
            1, none, self.amplitude[is_of_joint], self.order[is_of_joint], self.phase[is_of_joint]
        )

    def derivatives(self, q: np.ndarray) -> np.ndarray:
        """Return eps, eps', eps'', eps''' [rad, 1, 1/rad, 1/rad^2] at q (..., n) [rad], (4, ..., n)."""
        phase = self._phases(q)
        sine, cosine = self.amplitude * np.sin(phase), self.amplitude * np.cos(phase)
        n = self.order
        sines = np.array([sine, n * cosine, -(n**2) * sine, -(n**3) * cosine])
        return sines @ self._owner

    def output_angle(self, q: np.ndarray) -> np.ndarray:
        """Return u = q + eps(q) [rad] at q (..., n) [rad], (..., n)."""
        return q + (self.amplitude * np.sin(self._phases(q))) @ self._owner if self.count else q

    def slope(self, q: np.ndarray) -> np.ndarray:
        """Return du/dq = 1 + eps' [1] at q (..., n) [rad], (..., n)."""
        if self.count == 0:
            return np.ones_like(q)
        slope: np.ndarray = (self.amplitude * self.order * np.cos(self._phases(q))) @ self._owner
        return 1.0 + slope

    def at_output(self, drives: np.ndarray) -> np.ndarray:
        """Return u, u', u'' [rad, rad/s, rad/s^2] of q, q', q'', (3, ..., n) each."""
        if self.count == 0:
            return drives
        q, rate, acceleration = drives
        eps, slope, bend, _ = self.derivatives(q)
        rise = 1.0 + slope
        return np.array([q + eps, rise * rate, rise * acceleration + bend * rate**2])

    def motor_angle(self, output: np.ndarray) -> np.ndarray:
        """Return q of the angles u = q + eps(q) at the gears' outputs [rad], (..., n).

        By Newton's method, and where its step does not halve what is left, by q = u - eps(q), which does
        as |eps'| is 0.5 at most.
        """
        q = output.copy()
        if self.count == 0:
            return q
        enough = _ROUNDING * (1.0 + np.abs(output))
        eps, slope, *_ = self.derivatives(q)
        misfit = eps
        for _ in range(_PASSES):
            if np.all(np.abs(misfit) <= enough):
                break
            newton = q - misfit / (1.0 + slope)
            missed = self.output_angle(newton) - output
            q = np.where(np.abs(missed) < 0.5 * np.abs(misfit), newton, q - misfit)
            eps, slope, *_ = self.derivatives(q)
            misfit = q + eps - output
        return q

    def at_motor(self, outputs: np.ndarray) -> np.ndarray:
        """Return q, q', q'' [rad, rad/s, rad/s^2] of u, u', u'', (3, ..., n) each."""
        if self.count == 0:
            return outputs
        q = self.motor_angle(outputs[0])
        _, slope, bend, _ = self.derivatives(q)
        rate = outputs[1] / (1.0 + slope)
        return np.stack([q, rate, (outputs[2] - bend * rate**2) / (1.0 + slope)])

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

    def _phases(self, q: np.ndarray) -> np.ndarray:
        """Return the angles of the sines [rad], (..., s)."""
        return self.order * q[..., self.joint] + self.phase

    @cached_property
    def _owner(self) -> np.ndarray:
        """Whether a sine is a joint's, 1 or 0, (s, n)."""
        return np.eye(self.joint_count)[self.joint]


# Of one joint without any.
NO_ERRORS = KinematicErrors(1, np.zeros(0, dtype=int), *np.zeros((3, 0)))
