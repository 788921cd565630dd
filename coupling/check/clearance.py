"""Clearance: how far a tool can go from its path within the limits of its robot."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy.spatial.transform import Rotation

from coupling.inverse.joint_limits import JointLimits
from coupling.path.histories import ToolPath
from coupling.robot.batch.following import Targets, following, solve_poses
from coupling.robot.batch.rigid_robot import RigidRobot, TipMotion
from elastic_robot.description import Robot

# Largest number of places of the path that are looked at, and of the rays of an outline.
_MAX_PLACES, _RAY_COUNT = 30, 72
# Steps outwards [m] and how many at most: wide ones, then narrow ones from the last that was reached.
_OUTWARD_STEPS = ((0.1, 30), (0.01, 9))
# Iterations of inverse kinematics in each.
_ITERATIONS = 15
# What is nearer to the base's axis has no direction outward [m].
_ON_AXIS = 0.02
# Joints of a robot whose Jacobian has a determinant.
_SQUARE = 6
# As near to a singular posture as inverse kinematics goes (`Following.conditioning`).
_SINGULAR = 1e-3
# What a path is moved along, base axes.
DIRECTIONS = {
    "+x": (1.0, 0.0, 0.0),
    "-x": (-1.0, 0.0, 0.0),
    "+y": (0.0, 1.0, 0.0),
    "-y": (0.0, -1.0, 0.0),
    "+z": (0.0, 0.0, 1.0),
    "-z": (0.0, 0.0, -1.0),
}


@dataclass(frozen=True)
class Clearance:
    """Clearance around a path, in the robot's base.

    Attributes:
        conditioning: Smallest distance from singular postures along the path, `Following.conditioning`.
        free: Distance by which the whole path can be moved along each of `DIRECTIONS` before the robot
            does not reach it, passes a limit or is singular [m]; to a step of 0.01 m, at most 3 m.
        vertical: Outline of the places to which the TCP can be led from the path's middle, the tool
            at its first orientation, in the vertical plane through the base's z axis, closed [m],
            (k, 3).
        horizontal: The same in the horizontal plane [m], (k, 3).
        links: Base, centres of the joints and TCP at the path's first sample [m], (joints + 2, 3).
    """

    conditioning: float
    free: dict[str, float]
    vertical: np.ndarray
    horizontal: np.ndarray
    links: np.ndarray


def clearance_around(robot: Robot, path: ToolPath, q: np.ndarray) -> Clearance:
    """Return the clearance around the path of one tool, base frame.

    Args:
        q: Joint angles along it [rad], (n, joints).
    """
    walk = _Walk(RigidRobot(robot), JointLimits.of(robot))
    position, rotations = path.position[0], path.rotations[0]
    rows = np.unique(np.linspace(0, len(q) - 1, _MAX_PLACES).astype(int))
    rows = np.union1d(rows, [*position.argmin(axis=0), *position.argmax(axis=0)])
    middle = int(np.argmin(np.linalg.norm(position - position.mean(axis=0), axis=1)))
    outward = position[middle] * [1.0, 1.0, 0.0]
    length = float(np.linalg.norm(outward))
    outward = outward / length if length > _ON_AXIS else np.array([1.0, 0.0, 0.0])
    up, across = np.array([0.0, 0.0, 1.0]), np.array([-outward[1], outward[0], 0.0])
    rays = np.hstack([_rays(outward, up), _rays(outward, across)])
    # All at once: the steps of a small batch take as long as those of a large one.
    start = np.append(np.tile(rows, len(DIRECTIONS)), np.full(2 * _RAY_COUNT, middle))
    axes = np.array(list(DIRECTIONS.values())).T
    along = np.hstack([np.repeat(axes, len(rows), axis=1), rays])
    single = len(DIRECTIONS) + np.arange(2 * _RAY_COUNT)
    group = np.append(np.repeat(np.arange(len(DIRECTIONS)), len(rows)), single)
    ways = walk.ways(q[start].T, position[start].T, rotations[start], along, group)
    free = dict(zip(DIRECTIONS, ways[: len(DIRECTIONS)].tolist(), strict=True))
    ends = (position[middle][:, None] + ways[single] * rays).T
    vertical, horizontal = (
        np.vstack([ray_ends, ray_ends[:1]]) for ray_ends in (ends[:_RAY_COUNT], ends[_RAY_COUNT:])
    )
    conditioning, _ = walk.posture(q[rows].T)
    return Clearance(
        float(conditioning.min()), free, vertical, horizontal, walk.serial.points(q[0])
    )


def _rays(first: np.ndarray, second: np.ndarray) -> np.ndarray:
    """Return the directions all around in the plane of two axes, (3, rays)."""
    angle = np.linspace(0.0, 2.0 * np.pi, _RAY_COUNT, endpoint=False)
    return np.outer(first, np.cos(angle)) + np.outer(second, np.sin(angle))


class _Walk:
    """Leads the tool in steps, each from the posture of the last."""

    def __init__(self, serial: RigidRobot, limits: JointLimits) -> None:
        self.serial, self._limits = serial, limits

    def ways(
        self,
        q: np.ndarray,
        position: np.ndarray,
        rotations: Rotation,
        direction: np.ndarray,
        group: np.ndarray,
    ) -> np.ndarray:
        """Return how far all tools of a group go along their directions [m], (groups,).

        Args:
            q: Joint angles at n places [rad], (joints, n).
            position, rotations: Poses of the tools there.
            direction: Their directions, (3, n).
            group: Numbers of their groups, (n,).
        """
        rotation_columns = rotations.as_matrix().transpose(1, 2, 0)
        columns = [np.ascontiguousarray(rotation_columns[:, k]) for k in range(3)]
        way, q, (_, side) = np.zeros(group.max() + 1), q.copy(), self.posture(q)
        live = np.arange(len(group))
        for step, most in _OUTWARD_STEPS:
            ended = []
            for _ in range(most):
                target = position[:, live] + (way[group[live]] + step) * direction[:, live]
                targets = Targets(target, [c[:, live] for c in columns], np.zeros((3, len(live))))
                there, came = solve_poses(self.serial, targets, q[:, live], _ITERATIONS)
                conditioning, on_side = self.posture(there)
                is_reached = came & (conditioning > _SINGULAR) & self._within(there)
                is_reached &= on_side == side[live]  # no step leads across a singular posture
                ended.append(live[~is_reached])
                goes_on = ~np.isin(group[live], group[live[~is_reached]])
                live = live[goes_on]
                q[:, live] = there[:, goes_on]
                way[np.unique(group[live])] += step
                if len(live) == 0:
                    break
            # Narrow steps are those of the tools that end their groups: others go farther.
            live = np.concatenate([live, *ended])
        return way

    def posture(self, q: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Return the distance from singular postures, and on which side of them the robot is.

        Returns:
            `Following.conditioning` and, of a robot of six joints, 1 or -1, (n,) each.
        """
        rest_rates = np.zeros((3, q.shape[1]))
        at = following(
            self.serial, q, rest_rates, TipMotion(rest_rates, rest_rates, rest_rates, rest_rates)
        )
        if len(q) != _SQUARE:
            return at.conditioning, np.ones(q.shape[1])
        return at.conditioning, np.sign(np.linalg.det(at.posture.jacobian))

    def _within(self, q: np.ndarray) -> np.ndarray:
        above, below = q >= self._limits.lower[:, None], q <= self._limits.upper[:, None]
        return np.all(above & below, axis=0)
