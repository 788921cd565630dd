"""ToolPath -> JointPath and back: kinematics of the rigid robot along a path."""

from __future__ import annotations

from collections import deque

import numpy as np
from scipy.interpolate import CubicSpline
from scipy.spatial.transform import Rotation

from coupling.errors import PlanningError
from coupling.events import Progress, Watch, unwatched
from coupling.inverse.joint_limits import JointLimits
from coupling.native.desk_robot import DeskRobot, ReachRules
from coupling.path.histories import ToolPath, poses
from coupling.path.joint_path import JointPath
from coupling.results.limit_warning import LimitWarning
from coupling.robot.batch.following import Targets, nearest_angles, solve_poses
from coupling.robot.batch.redundancy import POSE, NearHome, few_joints
from coupling.robot.batch.rigid_robot import RigidRobot
from coupling.robot.blocked_path import BlockedPath, Obstacle, UnreachableError
from elastic_robot.chain import build_chain
from elastic_robot.description import Robot

# A pose is reached when position [m] and rotation [rad] agree to this: a tenth of a nanometre.
_POSE_TOLERANCE = 1e-10
_MAX_ITERATIONS = 100
# Remedy where a pose cannot be taken.
_MOVE = ": move the part (position_m in [part]), or find a place for it with elastic-robot place"
# A tool that stays farther away from its place is out of reach [m].
_AWAY = 1e-5
# Smallest singular value of the Jacobian, lengths in units of the reach: below it a joint moves
# more than a thousand times as fast as the tool.
_SINGULAR = 1e-3
# Largest joint motion between samples [rad]; more is a jump to another configuration.
_LARGEST_JUMP = 0.5
# Words for the progress, and samples between two reports of it.
_WORK = "planning by inverse kinematics"
_REPORT_EVERY = 500
# Where one sample in so many is planned from pose to pose the others lie close to a spline through them;
# of so many of these at least, by so many at once.
_PLANNED_STRIDE, _MIN_PLANNED, _BATCH_SIZE = 16, 8, 10_000
# How C approaches a pose.
_RULES = ReachRules.usual(_POSE_TOLERANCE, _MAX_ITERATIONS)
# A run asks for plans of its desired path and of the finer one that it inverts, in turn.
_KEPT_PLANS = 2


class InverseKinematics:
    """Inverse kinematics of one robot.

    With more than six joints every pose is held in the posture nearest to home, joints being kept clear
    of their limits (`NearHome`).

    Args:
        home: Joint angles near which the path is started [rad], (n,).

    Raises:
        PlanningError: If `home` has the wrong length.
    """

    def __init__(self, robot: Robot, home: np.ndarray, watch: Watch = unwatched) -> None:
        self._robot = robot
        self._chain = build_chain(robot)
        self._desk = DeskRobot(robot)
        self._rigid = RigidRobot(robot)
        if len(home) != self._chain.joint_count:
            raise PlanningError(
                f"home: expected {self._chain.joint_count} angles, one for each joint, got {len(home)}"
            )
        self._home = home
        self._limits = JointLimits.of(robot)
        self._near = NearHome(home, self._limits) if self._chain.joint_count > POSE else None
        self._watch = watch
        self._planned: deque[tuple[ToolPath, JointPath]] = deque(maxlen=_KEPT_PLANS)

    def plan(self, path: ToolPath) -> JointPath:
        """Return continuous joint angles along a path, by damped least squares.

        The paths planned last are not planned again.

        Raises:
            UnreachableError: With sample, time, distance and joint, if a pose is out of reach, beyond
                a joint limit, singular or only reached by a jump.
        """
        for last, joints in self._planned:
            if np.array_equal(last.time, path.time) and np.array_equal(last.pose, path.pose):
                return joints
        joints = self._along(path)
        self._planned.append((path, joints))
        return joints

    def _along(self, path: ToolPath) -> JointPath:
        angles = self._between_some(path)
        if angles is None:
            angles = self._from_pose_to_pose(path)
        self._require_limits(path, angles)
        return JointPath(path.time, (angles,))

    def _between_some(self, path: ToolPath) -> np.ndarray | None:
        """Return joint angles (n, joints) from those at some samples.

        None where that is no continuous plan of regular postures: from pose to pose there may be one, or
        a reason why there is none.
        """
        count, size = len(path.time), self._chain.joint_count
        if count < _PLANNED_STRIDE * _MIN_PLANNED:
            return None
        some = np.append(np.arange(0, count - 1, _PLANNED_STRIDE), count - 1)
        try:
            rows_of_poses = self._from_pose_to_pose(path.at_rows(some))
        except PlanningError:
            return None
        near = CubicSpline(path.time[some], rows_of_poses)
        angles = np.empty((count, size))
        for rows in np.array_split(np.arange(count), -(-count // _BATCH_SIZE)):
            q, is_reached = self._reach_poses(path.pose[0, rows], near(path.time[rows]))
            if (
                not is_reached.all()
                or _least_singular_values(self._scaled_jacobians(q)).min() < _SINGULAR
            ):
                return None
            angles[rows] = q
            self._watch(Progress(_WORK, int(rows[-1]) + 1, count))
        return None if np.abs(np.diff(angles, axis=0)).max() > _LARGEST_JUMP else angles

    def _reach_poses(self, rows: np.ndarray, start: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Return joint angles (k, joints) at poses (k, 7) from others, and whether each was reached."""
        if self._near is None:
            solution = self._desk.reach(_RULES, rows[:, :3], rows[:, 3:], self._chain.theta(start))
            return solution.theta[:, self._chain.drive], solution.error < _POSE_TOLERANCE
        targets = _targets(rows[:, :3], Rotation.from_quat(rows[:, 3:]).as_matrix())
        tolerance = _POSE_TOLERANCE / self._rigid.reach
        q, is_reached = solve_poses(
            self._rigid, targets, start.T, _MAX_ITERATIONS, tolerance, self._near
        )
        return q.T, is_reached

    def _scaled_jacobians(self, q: np.ndarray) -> np.ndarray:
        """Return the Jacobians at angles (n, joints), lengths in units of the reach, (n, 6, joints)."""
        scaled = self._rigid.posture(q.T).jacobian
        scaled[:, :3] /= self._rigid.reach
        return scaled

    def _from_pose_to_pose(self, path: ToolPath) -> np.ndarray:
        """Return joint angles (n, joints), each sample from those before it."""
        angles = np.empty((len(path.time), self._chain.joint_count))
        guess = self._begin(path.position[0][0], path.rotations[0][0].as_matrix())
        for k, pose in enumerate(path.pose[0]):
            try:
                angles[k] = self._solve(pose, guess)
                if k > 0:
                    self._require_continuity(angles[k], angles[k - 1])
            except _NoPostureError as no_posture:
                angles[k] = no_posture.q
                # A singular posture before it may be why.
                self._require_regular(path, angles[: k + (no_posture.obstacle.kind == "jump")])
                raise self._blocked(path, angles[: k + 1], no_posture) from no_posture
            # Linear extrapolation along the path saves an iteration.
            guess = 2.0 * angles[k] - angles[k - 1] if k > 0 else angles[k]
            if (k + 1) % _REPORT_EVERY == 0 or k + 1 == len(angles):
                self._watch(Progress(_WORK, k + 1, len(angles)))
        self._require_regular(path, angles)
        return angles

    def _begin(self, position: np.ndarray, rotation: np.ndarray) -> np.ndarray:
        """Return the angles to begin with at a path's first pose [rad], (joints,)."""
        if self._near is None:
            return self._home
        first = _targets(position[None], rotation[None])
        nearest, came = nearest_angles(self._rigid, first, self._near)
        return nearest[:, 0] if came[0] else self._home

    def forward(self, joints: JointPath, time: np.ndarray) -> ToolPath:
        """Return the path of the undeflected tool under a motion of the drives.

        Args:
            time: Rising, within the motion [s], (k,).

        Raises:
            TrajectoryError: If a time is outside the motion.
        """
        return ToolPath(time, self.poses(joints.trajectory.at(time)[0]))

    def poses(self, q: np.ndarray) -> np.ndarray:
        """Return the poses of the undeflected tool at joint angles [rad], (n, joints), (n, 7)."""
        position, rotation = self._desk.placements(self._chain.theta(q))
        return poses(position, Rotation.from_matrix(rotation))

    def rate_warnings(self, path: JointPath) -> list[LimitWarning]:
        """Return one warning for each joint whose maximum rate is exceeded."""
        rates = np.abs(np.diff(path.q[0], axis=0) / np.diff(path.time)[:, None])
        warnings = []
        for i, joint in enumerate(self._robot.joints):
            worst = int(np.argmax(rates[:, i]))
            if joint.max_rate is not None and rates[worst, i] > joint.max_rate:
                time, rate = float(path.time[worst]), float(rates[worst, i])
                warnings.append(LimitWarning.of("rate", rate, joint.max_rate, time, i + 1))
        return warnings

    def _solve(self, pose: np.ndarray, guess: np.ndarray) -> np.ndarray:
        """Return the joint angles at a pose (7,) from others [rad], (joints,)."""
        if self._near is None:
            solution = self._desk.reach(
                _RULES, pose[None, :3], pose[None, 3:], self._chain.theta(guess[None])
            )
            q, away = solution.theta[0, self._chain.drive], solution.away[0]
            came = solution.error[0] < _POSE_TOLERANCE
        else:
            (q,), (came,) = self._reach_poses(pose[None], guess[None])
            away = float(np.linalg.norm(self.poses(q[None])[0, :3] - pose[:3]))
        if came:
            return q
        if away < _AWAY:  # at the border of what it reaches an arm is stretched, and so singular
            jacobians = self._scaled_jacobians(q[None])
            if _least_singular_values(jacobians)[0] < _SINGULAR:
                raise _singular(jacobians[0], q)
        farthest = int(np.argmax(np.abs(q - guess))) + 1
        raise _NoPostureError(
            f"the pose at {np.round(pose[:3], 4).tolist()} m is out of reach;"
            f" the tool stays {1e3 * away:.0f} mm away (joint {farthest} moved farthest)"
            f"{few_joints(len(q)) or _MOVE}",
            q,
            Obstacle("reach", farthest, float(away)),
        )

    def _require_regular(self, path: ToolPath, angles: np.ndarray) -> None:
        """Refuse the first singular one of the postures (n, joints) at a path's first samples."""
        for first in range(0, len(angles), _BATCH_SIZE):
            jacobians = self._scaled_jacobians(angles[first : first + _BATCH_SIZE])
            for k in np.flatnonzero(_least_singular_values(jacobians) < _SINGULAR)[:1].tolist():
                until = angles[: first + k + 1]
                raise self._blocked(path, until, _singular(jacobians[k], until[-1]))

    def _blocked(
        self, path: ToolPath, angles: np.ndarray, no_posture: _NoPostureError
    ) -> UnreachableError:
        """Return the refusal of a path whose last of these postures (k, joints) cannot be taken."""
        blocked = BlockedPath(path, len(angles) - 1, angles.copy(), no_posture.obstacle)
        return UnreachableError(str(no_posture), self._robot, blocked)

    def _require_continuity(self, q: np.ndarray, last: np.ndarray) -> None:
        jump = np.abs(q - last)
        joint = int(np.argmax(jump))
        if jump[joint] > _LARGEST_JUMP:
            cause = "the path passes a singular posture or its samples are too far apart"
            if self._near is not None:
                cause += (
                    ", or another posture is nearer to home from here on: give a home posture nearer to"
                    " this path"
                )
            raise _NoPostureError(
                f"joint {joint + 1} would jump by {np.rad2deg(jump[joint]):.0f} deg; {cause}",
                q,
                Obstacle("jump", joint + 1, float(jump[joint])),
            )

    def _require_limits(self, path: ToolPath, angles: np.ndarray) -> None:
        low, high = self._limits.lower, self._limits.upper
        for i, k in np.argwhere(((angles < low) | (angles > high)).T)[:1].tolist():
            degrees = np.rad2deg([angles[k, i], low[i], high[i]])
            raise UnreachableError(
                f"joint {i + 1} is at {degrees[0]:.2f} deg; its"
                f" limits are {degrees[1]:.2f} to {degrees[2]:.2f} deg{_MOVE}",
                self._robot,
                BlockedPath(path, k, angles, Obstacle("limit", i + 1)),
            )


class _NoPostureError(Exception):
    """A posture that cannot be taken: why, its joint angles [rad], (joints,), and what is in the way."""

    def __init__(self, words: str, q: np.ndarray, obstacle: Obstacle) -> None:
        super().__init__(words)
        self.q, self.obstacle = q, obstacle


def _singular(jacobian: np.ndarray, q: np.ndarray) -> _NoPostureError:
    """Return the refusal of a posture by its Jacobian, lengths in units of the reach."""
    _, values, rows = np.linalg.svd(jacobian)
    joint = int(np.argmax(np.abs(rows[len(values) - 1]))) + 1
    return _NoPostureError(
        f"the robot is in a singular posture (smallest singular value {values[-1]:.2g}, joint {joint}"
        " moves most): move the part or the home posture",
        q,
        Obstacle("singular", joint),
    )


def _least_singular_values(jacobians: np.ndarray) -> np.ndarray:
    """Return the smallest singular value of each matrix, (n,)."""
    least: np.ndarray = np.linalg.svd(jacobians, compute_uv=False)[:, -1]
    return least


def _targets(position: np.ndarray, rotation: np.ndarray) -> Targets:
    """Return poses of positions [m], (k, 3), and rotation matrices, (k, 3, 3)."""
    tool = [np.ascontiguousarray(rotation[:, :, k].T) for k in range(3)]
    return Targets(position.T, tool, np.zeros((3, len(position))))
