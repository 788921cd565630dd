"""Kinematics and torques of one rigid robot in a batch of states."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy.spatial.transform import Rotation

from coupling.robot.batch.vectors import (
    Columns,
    combine_columns,
    cross,
    dot,
    rotate_columns,
    rotate_vector,
    seen_from,
)
from elastic_robot.balancers import BalancerCurve
from elastic_robot.description import Robot


@dataclass(frozen=True)
class BatchPosture:
    """A robot in n states, base axes.

    Attributes:
        angle: Joint angles [rad], (joints, n).
        axis: Directions of the joints' axes, (joints, 3, n).
        origin: Their centres [m], (joints, 3, n).
        body: Columns of the rotations of the bodies behind the joints.
        tip: TCP [m], (3, n).
        tool: Columns of base_from_tool.
        lever: Velocity of the TCP by the rate of each joint [m/rad], (joints, 3, n).
    """

    angle: np.ndarray
    axis: np.ndarray
    origin: np.ndarray
    body: list[Columns]
    tip: np.ndarray
    tool: Columns
    lever: np.ndarray

    @property
    def jacobian(self) -> np.ndarray:
        """Motion of the TCP [m/rad] and rotation [1] by the joints' angles, (n, 6, joints)."""
        return np.concatenate([self.lever, self.axis], axis=1).transpose(2, 1, 0)


@dataclass(frozen=True)
class TipMotion:
    """Motion of the tool, base axes.

    Attributes:
        velocity, acceleration: Velocity and acceleration of the TCP [m/s], [m/s^2], (3, n).
        spin, spin_rate: Angular velocity and acceleration [rad/s], [rad/s^2], (3, n).
    """

    velocity: np.ndarray
    acceleration: np.ndarray
    spin: np.ndarray
    spin_rate: np.ndarray


@dataclass(frozen=True)
class _BodyMotion:
    """Motion of a body: angular velocity and acceleration, acceleration of its joint's centre."""

    spin: np.ndarray
    spin_rate: np.ndarray
    acceleration: np.ndarray


class RigidRobot:
    """A robot whose joints do not give way."""

    def __init__(self, robot: Robot) -> None:
        self._axes = [joint.axis for joint in robot.joints]
        self._origins = [joint.origin for joint in robot.joints]
        self._bodies = [(k, joint.body) for k, joint in enumerate(robot.joints)]
        if robot.payload is not None:
            self._bodies.append((len(robot.joints) - 1, robot.payload))
        self._balancers = [
            (k, BalancerCurve.through(joint.balancer))
            for k, joint in enumerate(robot.joints)
            if joint.balancer is not None
        ]
        self._tool = Rotation.from_euler("xyz", robot.tcp_rpy).as_matrix()
        self._tcp = robot.tcp_position
        arms = [np.linalg.norm(origin) for origin in self._origins]
        self.reach = float(np.sum(arms) + np.linalg.norm(self._tcp))

    def posture(self, q: np.ndarray, tcp_shift: np.ndarray | None = None) -> BatchPosture:
        """Return the robot at drive angles.

        Args:
            q: Joint angles [rad], (joints, n).
            tcp_shift: Shift of the TCP on the tool, tool axes [m], (3, n); None: none.
        """
        size = q.shape[1]
        columns: Columns = [np.repeat(np.eye(3)[:, [k]], size, axis=1) for k in range(3)]
        at = np.zeros((3, size))
        axes, origins, lever = np.empty((3, len(q), 3, size))
        bodies = []
        for k, (axis, origin, angle) in enumerate(zip(self._axes, self._origins, q, strict=True)):
            at = at + combine_columns(columns, origin)
            axes[k], origins[k] = combine_columns(columns, axis), at
            columns = rotate_columns(columns, axis, angle)
            bodies.append(columns)
        tool = [combine_columns(columns, column) for column in self._tool.T.tolist()]
        tip = at + combine_columns(columns, self._tcp)
        if tcp_shift is not None:
            tip = tip + rotate_vector(tool, tcp_shift)
        for k, axis in enumerate(axes):
            lever[k] = cross(axis, tip - origins[k])
        return BatchPosture(q, axes, origins, bodies, tip, tool, lever)

    def points(self, q: np.ndarray) -> np.ndarray:
        """Return base, centres of the joints and TCP, to draw the robot, base axes [m], (joints + 2, 3).

        Args:
            q: Drive angles [rad], (joints,).
        """
        posture = self.posture(q[:, None])
        return np.vstack([np.zeros(3), posture.origin[..., 0], posture.tip[:, 0]])

    def bias(self, posture: BatchPosture, rate: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Return the accelerations of the TCP and of the tool's angle without joint accelerations.

        Args:
            rate: q' [rad/s], (joints, n).
        """
        zero = np.zeros((3, rate.shape[1]))
        *_, last = self._motion(posture, rate, np.zeros_like(rate), zero)
        arm = posture.tip - posture.origin[-1]
        return _point_acceleration(last, arm), last.spin_rate

    def load(
        self, posture: BatchPosture, rate: np.ndarray, acceleration: np.ndarray, gravity: np.ndarray
    ) -> np.ndarray:
        """Return M q'' + h less the balancers' torques [N m], (joints, n): Newton and Euler's equations.

        Args:
            rate, acceleration: q' [rad/s] and q'' [rad/s^2], (joints, n).
            gravity: Gravity, base axes [m/s^2], (3, n).
        """
        motions = self._motion(posture, rate, acceleration, -gravity)
        force, moment = np.zeros_like(gravity), np.zeros_like(gravity)  # about the base's origin
        load = np.empty_like(rate)
        bodies = list(self._bodies)
        for k in range(len(load) - 1, -1, -1):
            while bodies and bodies[-1][0] == k:
                _, body = bodies.pop()
                if body.mass == 0.0:
                    continue
                motion, columns = motions[k], posture.body[k]
                arm = combine_columns(columns, body.com)
                push = body.mass * _point_acceleration(motion, arm)
                spin, spin_rate = (seen_from(columns, v) for v in (motion.spin, motion.spin_rate))
                inertia = body.inertia_matrix
                spin_moment = inertia @ spin_rate + cross(spin, inertia @ spin)
                force = force + push
                moment = (
                    moment
                    + rotate_vector(columns, spin_moment)
                    + cross(posture.origin[k] + arm, push)
                )
            load[k] = dot(posture.axis[k], moment - cross(posture.origin[k], force))
        for k, curve in self._balancers:
            load[k] -= curve.torque(posture.angle[k])
        return load

    def _motion(
        self, posture: BatchPosture, rate: np.ndarray, acceleration: np.ndarray, base: np.ndarray
    ) -> list[_BodyMotion]:
        """Return the motion of every body; `base` is the acceleration of the base, (3, n)."""
        zero = np.zeros_like(base)
        motion, before, motions = _BodyMotion(zero, zero, base), zero, []
        for axis, origin, q_rate, q_acceleration in zip(
            posture.axis, posture.origin, rate, acceleration, strict=True
        ):
            at = _point_acceleration(motion, origin - before)
            turn = axis * q_rate
            spin_rate = motion.spin_rate + axis * q_acceleration + cross(motion.spin, turn)
            motion, before = _BodyMotion(motion.spin + turn, spin_rate, at), origin
            motions.append(motion)
        return motions


def _point_acceleration(motion: _BodyMotion, arm: np.ndarray) -> np.ndarray:
    """Return the acceleration of a point of a body, an arm away from its joint's centre."""
    whirl = cross(motion.spin, cross(motion.spin, arm))
    return motion.acceleration + cross(motion.spin_rate, arm) + whirl
