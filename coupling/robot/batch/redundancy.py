"""Joints beyond six: of all postures that hold the tool on a pose, the one nearest to home.

A robot of n > 6 joints moves by itself while its tool stands still.  A posture is therefore chosen where

    c(q) = sum (q - home)^2 / 2 + sum_limits b(q)

is smallest among those of a pose: b is zero as long as a joint is clear of its limits and rises steeply
towards them.  The choice depends on the pose alone, not on the way there: it is the same at any sampling
of a path, and a tool that comes back finds the joints as they were (the extended Jacobian, Baillieul
1985, docs/references.md).
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from coupling.inverse.joint_limits import JointLimits
from elastic_robot.kinematics import tcp_force_gradient

# Coordinates of a pose: more joints are redundant.
POSE = 6
# From this distance on joints are pushed away from their limits [rad]: at most this part of their range.
_LIMIT_DISTANCE, _LIMIT_RANGE_PART = np.deg2rad(10.0), 0.25
# How hard: at a limit as hard as home pulls from so far away [rad].
_PUSH = 40.0
# Least curvature of c along a self-motion that a step is measured by [1]: with less, home lies across a
# fold, and the posture nearest to it is another one.
_MIN_CURVATURE = 0.05


@dataclass(frozen=True)
class NearHome:
    """The cost c of a posture of n joints.

    Attributes:
        home: Posture that others are drawn to [rad], (n,), or one for each of k states, (k, n).
    """

    home: np.ndarray
    limits: JointLimits

    def chosen(self, rows: np.ndarray) -> NearHome:
        """Return the cost for the states of these numbers, (m,)."""
        home = self.home[rows] if self.home.ndim == 2 else self.home
        return NearHome(home, self.limits)

    def cost(self, q: np.ndarray) -> np.ndarray:
        """Return c [1], (k,), of joint angles [rad], (k, n)."""
        pushed = sum(0.25 * _PUSH * clear * near**4 for clear, near in self._close(q))
        total: np.ndarray = (0.5 * (q - self.home) ** 2 + pushed).sum(axis=1)
        return total

    def slopes(self, q: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Return first [rad] and second [1] derivatives of c by each joint, (k, n).

        Args:
            q: Joint angles [rad], (k, n).
        """
        (clear, above), (_, below) = self._close(q)
        first = q - self.home + _PUSH * (below**3 - above**3)
        second = 1.0 + 3.0 * _PUSH * (below**2 + above**2) / clear
        return first, second

    def _close(self, q: np.ndarray) -> list[tuple[np.ndarray, np.ndarray]]:
        """Return from where on the lower and the upper limits push [rad], and how near they are [1]."""
        lower, upper = self.limits.lower, self.limits.upper
        clear = np.minimum(_LIMIT_DISTANCE, _LIMIT_RANGE_PART * (upper - lower))
        return [(clear, np.maximum(1.0 - margin / clear, 0.0)) for margin in (q - lower, upper - q)]


@dataclass(frozen=True)
class SelfMotion:
    """What c asks for beside the tool's motion, in k states.

    Attributes:
        directions: Orthonormal joint rates that leave the tool where it is [1], (k, n, n - 6).
        bend: Derivative of c's slope along them by the joints [1], (k, n - 6, n).
        slope: Slope of c along them [rad], (k, n - 6).
    """

    directions: np.ndarray
    bend: np.ndarray
    slope: np.ndarray

    @classmethod
    def of(cls, jacobian: np.ndarray, q: np.ndarray, near: NearHome) -> SelfMotion:
        """Return that of states.

        Args:
            jacobian: Jacobians of the TCP, base axes, lengths in any unit [1], (k, 6, n).
            q: Joint angles [rad], (k, n).
        """
        first, second = near.slopes(q)
        multipliers = np.linalg.pinv(jacobian.swapaxes(1, 2)) @ first[:, :, None]
        # c's slope is J^T of a wrench at the minimum: what turns that wrench's torques, turns it.
        hessian = -tcp_force_gradient(jacobian, multipliers[:, :, 0])
        each = np.arange(q.shape[1])
        hessian[:, each, each] += second
        complete = np.linalg.qr(jacobian.swapaxes(1, 2), mode="complete")[0]
        directions = complete[:, :, POSE:]
        across = directions.swapaxes(1, 2)
        return cls(directions, across @ hessian, (across @ first[:, :, None])[:, :, 0])

    def step(self, of_task: np.ndarray) -> np.ndarray:
        """Return the step along the self-motion towards the minimum of c [rad], (k, n).

        Newton's, and downhill where c is not convex.

        Args:
            of_task: Step that brings the tool to its pose [rad], (k, n).
        """
        curvature, vectors = np.linalg.eigh(self._curvature)
        right = self.slope + (self.bend @ of_task[:, :, None])[:, :, 0]
        along = (vectors.swapaxes(1, 2) @ right[:, :, None])[:, :, 0]
        along /= np.maximum(np.abs(curvature), _MIN_CURVATURE)
        return -(self.directions @ (vectors @ along[:, :, None]))[:, :, 0]

    def rate(self, of_task: np.ndarray) -> np.ndarray:
        """Return the rates along the self-motion that keep c smallest [rad/s], (k, n).

        Args:
            of_task: Joint rates that move the tool [rad/s], (k, n).
        """
        right = (self.bend @ of_task[:, :, None])[:, :, 0]
        along = np.linalg.solve(self._curvature, right[:, :, None])
        return -(self.directions @ along)[:, :, 0]

    @property
    def _curvature(self) -> np.ndarray:
        curvature = self.bend @ self.directions
        return 0.5 * (curvature + curvature.swapaxes(1, 2))


def task_step(jacobian: np.ndarray, error: np.ndarray, damping: np.ndarray) -> np.ndarray:
    """Return the damped least-squares step J^T (J J^T + damping)^-1 error [rad], (k, n).

    Args:
        jacobian: Jacobians, lengths in any unit [1], (k, 6, n), n >= 6.
        error: From the poses to the targets, lengths as in the Jacobians [1], (k, 6).
        damping: Damping [1], > 0 where a Jacobian may be singular, (k,).
    """
    gram = jacobian @ jacobian.swapaxes(1, 2)
    each = np.arange(gram.shape[1])
    gram[:, each, each] += damping[:, None]
    step: np.ndarray = jacobian.swapaxes(1, 2) @ np.linalg.solve(gram, error[:, :, None])
    return step[:, :, 0]


def few_joints(count: int) -> str:
    """Return what a robot of fewer than six joints cannot do, to end a sentence with; "" for others."""
    if count >= POSE:
        return ""
    return f": {count} joints hold a tool at few of the orientations that a path may ask for, six at any"
