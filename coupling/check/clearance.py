"""Clearance: how far a tool can go from its path within the limits of its robot."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy.spatial.transform import Rotation

from coupling.inverse.joint_limits import JointLimits
from coupling.path.histories import ToolPath
from coupling.robot.batch.following import Targets, following, reached
from coupling.robot.batch.serial_robot import SerialRobot, TipMotion
from coupling.robot.links import link_points
from elastic_robot.description import Robot

# Largest number of places of the path that are looked at, and of the rays of an outline.
_PLACES, _RAYS = 30, 72
# Steps outwards [m] and how many at most: wide ones, then narrow ones from the last that was reached.
_STEPS = ((0.1, 30), (0.01, 9))
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
    walk = _Walk(SerialRobot(robot), JointLimits.of(robot))
    position, rotations = path.position[0], path.rotations[0]
    rows = np.unique(np.linspace(0, len(q) - 1, _PLACES).astype(int))
    rows = np.union1d(rows, [*position.argmin(axis=0), *position.argmax(axis=0)])
    every = np.tile(rows, len(DIRECTIONS))
    along = np.repeat(np.array(list(DIRECTIONS.values())).T, len(rows), axis=1)
    ways = walk.ways(q[every].T, position[every].T, rotations[every], along)
    least = ways.reshape(len(DIRECTIONS), -1).min(axis=1).tolist()
    free = dict(zip(DIRECTIONS, least, strict=True))
    middle = int(np.argmin(np.linalg.norm(position - position.mean(axis=0), axis=1)))
    outward = position[middle] * [1.0, 1.0, 0.0]
    length = float(np.linalg.norm(outward))
    outward = outward / length if length > _ON_AXIS else np.array([1.0, 0.0, 0.0])
    up, across = np.array([0.0, 0.0, 1.0]), np.array([-outward[1], outward[0], 0.0])
    at = q[middle], position[middle], rotations[middle]
    vertical, horizontal = walk.outline(*at, (outward, up)), walk.outline(*at, (outward, across))
    return Clearance(
        walk.conditioning(q[rows].T), free, vertical, horizontal, link_points(robot, q[0])
    )


class _Walk:
    """Leads the tool in steps, each from the posture of the last."""

    def __init__(self, serial: SerialRobot, limits: JointLimits) -> None:
        self.serial, self._limits = serial, limits

    def conditioning(self, q: np.ndarray) -> float:
        return float(self._conditioning(q).min())

    def ways(
        self, q: np.ndarray, position: np.ndarray, rotations: Rotation, direction: np.ndarray
    ) -> np.ndarray:
        """Return how far the tool goes from each of n places along its direction [m], (n,)."""
        count = position.shape[1]
        turned = rotations.as_matrix().transpose(1, 2, 0)
        columns = [np.ascontiguousarray(turned[:, k]) for k in range(3)]
        way, q, side = np.zeros(count), q.copy(), self._side(q)
        for step, most in _STEPS:
            live = np.arange(count)
            for _ in range(most):
                target = position[:, live] + (way[live] + step) * direction[:, live]
                wanted = Targets(target, [c[:, live] for c in columns], np.zeros((3, len(live))))
                there, came = reached(self.serial, wanted, q[:, live], _ITERATIONS)
                held = came & (self._conditioning(there) > _SINGULAR) & self._within(there)
                held &= self._side(there) == side[live]  # no step leads across a singular posture
                live = live[held]
                q[:, live] = there[:, held]
                way[live] += step
                if len(live) == 0:
                    break
        return way

    def outline(
        self,
        q: np.ndarray,
        position: np.ndarray,
        rotation: Rotation,
        axes: tuple[np.ndarray, np.ndarray],
    ) -> np.ndarray:
        """Return the ends of rays from a place in a plane, closed [m], (rays + 1, 3)."""
        angle = np.linspace(0.0, 2.0 * np.pi, _RAYS, endpoint=False)
        rays = np.outer(axes[0], np.cos(angle)) + np.outer(axes[1], np.sin(angle))
        same = Rotation.concatenate([rotation] * _RAYS)
        start = np.tile(q[:, None], _RAYS), np.tile(position[:, None], _RAYS)
        ends = position[:, None] + self.ways(*start, same, rays) * rays
        return np.vstack([ends.T, ends[:, 0]])

    def _conditioning(self, q: np.ndarray) -> np.ndarray:
        still = np.zeros((3, q.shape[1]))
        at = following(self.serial, q, still, TipMotion(still, still, still, still))
        return at.conditioning

    def _side(self, q: np.ndarray) -> np.ndarray:
        """Return on which side of the singular postures a robot of six joints is, 1 or -1, (n,)."""
        posture = self.serial.posture(q, np.zeros((3, q.shape[1])))
        if len(q) != _SQUARE:
            return np.ones(q.shape[1])
        jacobian = np.concatenate([posture.lever, posture.axis], axis=1).transpose(2, 1, 0)
        return np.sign(np.linalg.det(jacobian))

    def _within(self, q: np.ndarray) -> np.ndarray:
        above, below = q >= self._limits.lower[:, None], q <= self._limits.upper[:, None]
        return np.all(above & below, axis=0)
