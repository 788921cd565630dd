"""Inverse kinematics of a batch: joint angles, rates and accelerations of a tool's motion."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from scipy.spatial.transform import Rotation

from coupling.native.desk_robot import DAMPING, LARGEST_STEP, LEAST_DAMPING
from coupling.robot.batch.redundancy import POSE, NearHome, SelfMotion, task_step
from coupling.robot.batch.rigid_robot import BatchPosture, RigidRobot, TipMotion
from coupling.robot.batch.vectors import Columns, cross, dot

# A pose is reached when position and rotation agree to this, lengths in units of the reach.
_POSE_TOLERANCE = 1e-8
# A posture is the one nearest to home when so little is left along the self-motion [rad].
_SELF_MOTION_TOLERANCE = 1e-9
# Postures around home that a search for the nearest one starts from, their spread [rad] and seed.
_START_COUNT, _START_SPREAD, _SEED = 16, 1.0, 1
# Angle by which accelerations of a redundant robot look ahead and back [rad].
_DIFFERENCE_ANGLE = 1e-4
# Steps in which the tool is led from the home posture to a pose, iterations in each, and at its end.
_LEAD_STEPS, _LEAD_ITERATIONS, _MAX_ITERATIONS = 8, 2, 30


@dataclass(frozen=True)
class Targets:
    """Poses of the TCP, base axes.

    Attributes:
        position: Positions of the TCP [m], (3, n).
        tool: Columns of base_from_tool.
        tcp_shift: Shift of the TCP on the tool, tool axes [m], (3, n).
        quaternion: Quaternions of base_from_tool, x, y, z, w [1], (n, 4); None where not known.
    """

    position: np.ndarray
    tool: Columns
    tcp_shift: np.ndarray
    quaternion: np.ndarray | None = None

    def chosen(self, rows: np.ndarray) -> Targets:
        """Return the targets of these numbers, (k,), or of a mask, (n,)."""
        tool = [column[:, rows] for column in self.tool]
        quaternion = None if self.quaternion is None else self.quaternion[rows]
        return Targets(self.position[:, rows], tool, self.tcp_shift[:, rows], quaternion)

    @property
    def quaternions(self) -> np.ndarray:
        """Quaternions of base_from_tool, x, y, z, w [1], (n, 4)."""
        if self.quaternion is not None:
            return self.quaternion
        matrices = np.stack(self.tool, axis=1).transpose(2, 0, 1)
        quaternions: np.ndarray = Rotation.from_matrix(matrices).as_quat()
        return quaternions


PoseSolver = Callable[[Targets, np.ndarray, int], tuple[np.ndarray, np.ndarray]]


def solve_poses(
    robot: RigidRobot,
    targets: Targets,
    start: np.ndarray,
    iterations: int = _MAX_ITERATIONS,
    tolerance: float = _POSE_TOLERANCE,
    near: NearHome | None = None,
) -> tuple[np.ndarray, np.ndarray]:
    """Return joint angles at poses by damped least squares, and whether each pose was reached.

    Args:
        start: Angles to begin with [rad], (joints, n).
        tolerance: Error of a pose that is reached, lengths in units of the reach [1].
        near: Cost that chooses a posture where there are more than six joints; None: the shortest way.
    """
    q, is_reached = start.copy(), np.zeros(start.shape[1], dtype=bool)
    live = np.arange(start.shape[1])
    for _ in range(iterations):
        now = targets.chosen(live)
        posture = robot.posture(q[:, live], now.tcp_shift)
        error = _error(posture, now, robot.reach)
        size = dot(error, error)
        step, nearest = _step(posture, robot.reach, error, size, near and near.chosen(live))
        converged = (size < tolerance**2) & nearest
        is_reached[live[converged]] = True
        if converged.all():
            break
        largest = np.maximum(np.abs(step).max(axis=0), 1e-300)
        step *= np.minimum(1.0, LARGEST_STEP / largest)
        keep = ~converged
        q[:, live[keep]] += step[:, keep]
        live = live[keep]
    return q, is_reached


def angles_from_home(
    robot: RigidRobot, targets: Targets, home: np.ndarray, solve: PoseSolver
) -> tuple[np.ndarray, np.ndarray]:
    """Return joint angles at poses to which the tool is led from a home posture, and whether it came.

    The way is straight in position and in rotation, so that the robot keeps its configuration.

    Args:
        home: Angles of the home posture [rad], (joints,).
        solve: Function of targets, angles to begin with and iterations, such as `DeskPoses.solve`.
    """
    begin = robot.posture(home[:, None])
    first = Rotation.from_matrix(np.stack(begin.tool, axis=1)[:, :, 0])
    last = Rotation.from_quat(targets.quaternions)
    turn = (last * first.inv()).as_rotvec()
    q = np.repeat(home[:, None], targets.position.shape[1], axis=1)
    for k in range(1, _LEAD_STEPS):
        share = k / _LEAD_STEPS
        rotation = Rotation.from_rotvec(share * turn) * first
        position = (1.0 - share) * begin.tip + share * targets.position
        tool = [np.ascontiguousarray(column) for column in rotation.as_matrix().transpose(2, 1, 0)]
        shift = share * targets.tcp_shift
        on_the_way = Targets(position, tool, shift, rotation.as_quat())
        q, _ = solve(on_the_way, q, _LEAD_ITERATIONS)
    return solve(targets, q, _MAX_ITERATIONS)


def self_motion(robot: RigidRobot, q: np.ndarray) -> np.ndarray:
    """Return the self-motion of a posture, by the angle of its freest joint [1], (joints,).

    Args:
        q: Joint angles of a robot of more than six joints [rad], (joints,).
    """
    jacobian = _jacobian(robot.posture(q[:, None]), robot.reach)[0]
    free = np.eye(len(q)) - np.linalg.pinv(jacobian) @ jacobian
    most = int(np.argmax(np.diag(free)))
    direction: np.ndarray = free[most] / np.abs(free[most]).max()
    return direction


def nearest_angles(
    robot: RigidRobot, targets: Targets, near: NearHome
) -> tuple[np.ndarray, np.ndarray]:
    """Return the postures nearest to home that hold the tool on poses, and whether any was reached.

    Of those that a search from home and from some postures around it finds.

    Args:
        near: Cost that chooses among postures.

    Returns:
        Joint angles [rad], (joints, n), and a mask, (n,).
    """
    rng, (size, count) = (
        np.random.default_rng(_SEED),
        (near.home.shape[-1], len(targets.position.T)),
    )
    homes = np.broadcast_to(near.home, (count, size))
    around = _START_SPREAD * rng.normal(size=(_START_COUNT, 1, size))
    around[0] = 0.0
    starts = np.clip(homes + around, near.limits.lower, near.limits.upper).reshape(-1, size)
    each = NearHome(np.tile(homes, (_START_COUNT, 1)), near.limits)
    every = targets.chosen(np.tile(np.arange(count), _START_COUNT))
    q, came = solve_poses(robot, every, starts.T, near=each)
    cost = np.where(came, each.cost(q.T), np.inf).reshape(_START_COUNT, count)
    best = np.argmin(cost, axis=0) * count + np.arange(count)
    return q[:, best], came[best]


@dataclass(frozen=True)
class FollowingRobot:
    """Posture, rates and accelerations of a robot in motion.

    Attributes:
        rate, acceleration: q' [rad/s], q'' [rad/s^2], (joints, n).
        conditioning: 1 / |J^+| [1], (n,), by Frobenius' norm, lengths over the reach: at most the
            smallest singular value of J, and at least 0.4 of it for six joints or more.
    """

    posture: BatchPosture
    rate: np.ndarray
    acceleration: np.ndarray
    conditioning: np.ndarray


def following(
    robot: RigidRobot,
    q: np.ndarray,
    tcp_shift: np.ndarray,
    motion: TipMotion,
    near: NearHome | None = None,
) -> FollowingRobot:
    """Return rates and accelerations of the joints with the tool in motion.

    Args:
        q: Joint angles [rad], (joints, n).
        tcp_shift: Shift of the TCP on the tool, tool axes [m], (3, n).
        near: Cost that chooses among the postures of a robot of more than six joints, whose angles these
            are; None: the smallest rates.
    """
    posture = robot.posture(q, tcp_shift)
    if len(q) <= POSE:
        normal, transposed = _normal(posture, robot.reach, np.zeros(q.shape[1]))
        inverse = np.linalg.inv(normal)
    else:
        jacobian = _jacobian(posture, robot.reach)
        inverse = np.linalg.inv(
            jacobian @ jacobian.swapaxes(1, 2) + LEAST_DAMPING * np.eye(jacobian.shape[1])
        )

    def joints(velocity: np.ndarray, spin: np.ndarray) -> np.ndarray:
        task = np.concatenate([velocity / robot.reach, spin])
        if len(q) > POSE:
            return np.einsum("nji,njk,kn->in", jacobian, inverse, task, optimize=True)
        gradient = np.einsum("jkn,kn->jn", transposed, task)
        return np.einsum("nij,jn->in", inverse, gradient)

    rate = joints(motion.velocity, motion.spin)
    if len(q) > POSE and near is not None:
        rate = rate + SelfMotion.of(jacobian, q.T, near).rate(rate.T).T
        acceleration = _bending(robot, q, tcp_shift, motion, rate, near)
    else:
        by_rates, spin_by_rates = robot.bias(posture, rate)
        acceleration = joints(motion.acceleration - by_rates, motion.spin_rate - spin_by_rates)
    return FollowingRobot(
        posture, rate, acceleration, 1.0 / np.sqrt(np.trace(inverse, axis1=1, axis2=2))
    )


def _bending(
    robot: RigidRobot,
    q: np.ndarray,
    tcp_shift: np.ndarray,
    motion: TipMotion,
    rate: np.ndarray,
    near: NearHome,
) -> np.ndarray:
    """Return q'' [rad/s^2], (joints, n): central differences of the rates along the motion."""
    ahead = _DIFFERENCE_ANGLE / np.maximum(np.abs(rate).max(axis=0), _DIFFERENCE_ANGLE)
    ends = []
    for time in (ahead, -ahead):
        there = q + time * rate
        jacobian = _jacobian(robot.posture(there, tcp_shift), robot.reach)
        velocity = motion.velocity + time * motion.acceleration
        spin = motion.spin + time * motion.spin_rate
        task = np.concatenate([velocity / robot.reach, spin]).T
        of_task = task_step(jacobian, task, np.full(len(task), LEAST_DAMPING))
        ends.append(of_task + SelfMotion.of(jacobian, there.T, near).rate(of_task))
    bending: np.ndarray = (ends[0] - ends[1]).T / (2.0 * ahead)
    return bending


def _step(
    posture: BatchPosture,
    reach: float,
    error: np.ndarray,
    size: np.ndarray,
    near: NearHome | None,
) -> tuple[np.ndarray, np.ndarray]:
    """Return the step to the targets [rad], (joints, n), and a mask of postures nearest to home."""
    if len(posture.angle) <= POSE:
        normal, transposed = _normal(posture, reach, DAMPING * size)
        gradient = np.einsum("jkn,kn->nj", transposed, error)
        step = np.linalg.solve(normal, gradient[:, :, None])[:, :, 0].T
        return step, np.ones(len(size), dtype=bool)
    jacobian = _jacobian(posture, reach)
    step = task_step(jacobian, error.T, DAMPING * size + LEAST_DAMPING)
    if near is None:
        return step.T, np.ones(len(size), dtype=bool)
    along = SelfMotion.of(jacobian, posture.angle.T, near).step(step)
    return (step + along).T, np.abs(along).max(axis=1) < _SELF_MOTION_TOLERANCE


def _jacobian(posture: BatchPosture, reach: float) -> np.ndarray:
    """Return J, (n, 6, joints), lengths over the reach."""
    transposed = np.concatenate([posture.lever / reach, posture.axis], axis=1)
    return np.ascontiguousarray(transposed.transpose(2, 1, 0))


def _error(posture: BatchPosture, targets: Targets, reach: float) -> np.ndarray:
    """Return from the poses to the targets: position over the reach, and sin(angle) axis, (6, n)."""
    turn = sum(cross(axis, goal) for axis, goal in zip(posture.tool, targets.tool, strict=True))
    return np.concatenate([(targets.position - posture.tip) / reach, 0.5 * np.asarray(turn)])


def _normal(
    posture: BatchPosture, reach: float, damping: np.ndarray
) -> tuple[np.ndarray, np.ndarray]:
    """Return J^T J + damping, (n, joints, joints), and J^T, (joints, 6, n), lengths over the reach."""
    transposed = np.concatenate([posture.lever / reach, posture.axis], axis=1)
    normal = np.einsum("ikn,jkn->nij", transposed, transposed)
    each = np.arange(len(transposed))
    normal[:, each, each] += (damping + LEAST_DAMPING)[:, None]
    return normal, transposed
