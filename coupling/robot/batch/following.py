"""Inverse kinematics of a batch: joint angles, rates and accelerations of a tool's motion."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy.spatial.transform import Rotation

from coupling.robot.batch.serial_robot import BatchPosture, SerialRobot, TipMotion
from coupling.robot.batch.vectors import Columns, cross, dot

# A pose is reached when position and rotation agree to this, lengths in units of the reach.
_REACHED = 1e-8
# Levenberg-Marquardt damping relative to the squared pose error (Sugihara 2011, eq. (33)).
_DAMPING = 1e-3
# What keeps the inverse of a singular matrix finite.
_LEAST = 1e-12
# Joint step limit of one iteration [rad]: the linearisation holds no further.
_LARGEST_STEP = 0.3
# Steps in which the tool is led from the home posture to a pose, iterations in each, and at its end.
_LED, _ITERATIONS_LED, _ITERATIONS = 8, 2, 30


@dataclass(frozen=True)
class Targets:
    """Poses of the TCP, base axes.

    Attributes:
        position: Positions of the TCP [m], (3, n).
        tool: Columns of base_from_tool.
        tcp_shift: Shift of the TCP on the tool, tool axes [m], (3, n).
    """

    position: np.ndarray
    tool: Columns
    tcp_shift: np.ndarray

    def chosen(self, rows: np.ndarray) -> Targets:
        """Return the targets of these numbers, (k,), or of a mask, (n,)."""
        tool = [column[:, rows] for column in self.tool]
        return Targets(self.position[:, rows], tool, self.tcp_shift[:, rows])


def reached(
    robot: SerialRobot,
    targets: Targets,
    start: np.ndarray,
    iterations: int = _ITERATIONS,
    tolerance: float = _REACHED,
) -> tuple[np.ndarray, np.ndarray]:
    """Return joint angles at poses by damped least squares, and whether each pose was reached.

    Args:
        targets: The poses.
        start: Angles to begin with [rad], (joints, n).
        iterations: Iterations at most.
        tolerance: Error of a pose that is reached, lengths in units of the reach [1].
    """
    q, found = start.copy(), np.zeros(start.shape[1], dtype=bool)
    live = np.arange(start.shape[1])
    for _ in range(iterations):
        now = targets.chosen(live)
        posture = robot.posture(q[:, live], now.tcp_shift)
        error = _error(posture, now, robot.reach)
        size = dot(error, error)
        done = size < tolerance**2
        found[live[done]] = True
        if done.all():
            break
        normal, transposed = _normal(posture, robot.reach, _DAMPING * size)
        gradient = np.einsum("jkn,kn->nj", transposed, error)
        step = np.linalg.solve(normal, gradient[:, :, None])[:, :, 0].T
        largest = np.maximum(np.abs(step).max(axis=0), 1e-300)
        step *= np.minimum(1.0, _LARGEST_STEP / largest)
        keep = ~done
        q[:, live[keep]] += step[:, keep]
        live = live[keep]
    return q, found


def angles_from_home(
    robot: SerialRobot, targets: Targets, home: np.ndarray
) -> tuple[np.ndarray, np.ndarray]:
    """Return joint angles at poses to which the tool is led from a home posture, and whether it came.

    The way is straight in position and in rotation, so that the robot keeps its configuration.

    Args:
        targets: The poses.
        home: Angles of the home posture [rad], (joints,).
    """
    begin = robot.posture(home[:, None], np.zeros((3, 1)))
    first = Rotation.from_matrix(np.stack(begin.tool, axis=1)[:, :, 0])
    last = Rotation.from_matrix(np.stack(targets.tool, axis=1).transpose(2, 0, 1))
    turn = (last * first.inv()).as_rotvec()
    q = np.repeat(home[:, None], targets.position.shape[1], axis=1)
    for k in range(1, _LED):
        share = k / _LED
        rotation = (Rotation.from_rotvec(share * turn) * first).as_matrix()
        position = (1.0 - share) * begin.tip + share * targets.position
        tool = [np.ascontiguousarray(rotation[:, :, c].T) for c in range(3)]
        on_the_way = Targets(position, tool, share * targets.tcp_shift)
        q, _ = reached(robot, on_the_way, q, _ITERATIONS_LED)
    return reached(robot, targets, q)


@dataclass(frozen=True)
class FollowingRobot:
    """Posture, rates and accelerations of a robot in motion.

    Attributes:
        posture: Its posture.
        rate, acceleration: q' [rad/s], q'' [rad/s^2], (joints, n).
        conditioning: 1 / |J^-1| [1], (n,), by Frobenius' norm, lengths over the reach: at most the
            smallest singular value of J, and at least 0.4 of it for six joints.
    """

    posture: BatchPosture
    rate: np.ndarray
    acceleration: np.ndarray
    conditioning: np.ndarray


def following(
    robot: SerialRobot, q: np.ndarray, tcp_shift: np.ndarray, motion: TipMotion
) -> FollowingRobot:
    """Return rates and accelerations of the joints with the tool in motion.

    Args:
        q: Joint angles [rad], (joints, n).
        tcp_shift: Shift of the TCP on the tool, tool axes [m], (3, n).
        motion: Motion of the tool.
    """
    posture = robot.posture(q, tcp_shift)
    normal, transposed = _normal(posture, robot.reach, np.zeros(q.shape[1]))
    inverse = np.linalg.inv(normal)

    def joints(velocity: np.ndarray, spin: np.ndarray) -> np.ndarray:
        task = np.concatenate([velocity / robot.reach, spin])
        gradient = np.einsum("jkn,kn->jn", transposed, task)
        return np.einsum("nij,jn->in", inverse, gradient)

    rate = joints(motion.velocity, motion.spin)
    acceleration, spin_rate = robot.bias(posture, rate)
    missing = joints(motion.acceleration - acceleration, motion.spin_rate - spin_rate)
    return FollowingRobot(
        posture, rate, missing, 1.0 / np.sqrt(np.trace(inverse, axis1=1, axis2=2))
    )


def _error(posture: BatchPosture, targets: Targets, reach: float) -> np.ndarray:
    """Return from the poses to the targets: position over the reach, and sin(angle) axis, (6, n)."""
    turn = sum(cross(own, wanted) for own, wanted in zip(posture.tool, targets.tool, strict=True))
    return np.concatenate([(targets.position - posture.tip) / reach, 0.5 * np.asarray(turn)])


def _normal(
    posture: BatchPosture, reach: float, damping: np.ndarray
) -> tuple[np.ndarray, np.ndarray]:
    """Return J^T J + damping, (n, joints, joints), and J^T, (joints, 6, n), lengths over the reach."""
    transposed = np.concatenate([posture.lever / reach, posture.axis], axis=1)
    normal = np.einsum("ikn,jkn->nij", transposed, transposed)
    each = np.arange(len(transposed))
    normal[:, each, each] += (damping + _LEAST)[:, None]
    return normal, transposed
