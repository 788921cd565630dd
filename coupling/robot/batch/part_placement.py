"""Placement of a first part before any robot, and the postures in which it is reached."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy.spatial.transform import Rotation

from coupling.errors import PlanningError
from coupling.inverse.joint_limits import JointLimits
from coupling.robot.batch.following import FollowingRobot, Targets, following, solve_poses
from coupling.robot.batch.redundancy import few_joints
from coupling.robot.batch.rigid_robot import RigidRobot, TipMotion
from elastic_robot.description import Robot

# Postures that inverse kinematics starts from, and their seed.
_START_COUNT, _SEED = 1200, 1
_ITERATIONS = 60
# Box of places in front of the base, in units of the robot's reach: outward and up.
_OUTWARD, _UP = (0.3, 0.85), (0.05, 0.6)
# From here on a posture is regular enough, and far enough from the joints' limits [rad].
_MIN_REGULARITY, _MIN_LIMIT_DISTANCE = 0.1, np.deg2rad(25.0)
# What counts as a limit of a joint that has none [rad]: postures beyond are hard to read.
_ASSUMED_LIMIT = np.pi
# How much a posture bent by a whole turn loses: of two alike the straighter one is taken.
_BEND_PENALTY = 0.15


@dataclass(frozen=True)
class PartPlacement:
    """A place for a part, and the posture in which the untilted tool is on it.

    Attributes:
        position: Origin of the part in the robot's base, in its x-z plane [m], (3,).
        home: Joint angles with the TCP there [rad], (joints,).
    """

    position: np.ndarray
    home: np.ndarray


def part_placements(
    robot: Robot, base_from_tool: Rotation, half_size: float, count: int
) -> list[PartPlacement]:
    """Return places around which a robot holds its tool at one orientation, the best first.

    From random postures the tool is taken to random places of the robot's x-z plane.  A place counts as
    much as the worst of the corners around it does: by its distance from singular postures and from the
    joints' limits.

    Args:
        base_from_tool: Orientation of its tool.
        half_size: The part reaches so far to all sides of its origin [m].

    Raises:
        PlanningError: If the robot reaches none with that orientation.
    """
    serial, rng = RigidRobot(robot), np.random.default_rng(_SEED)
    limits = JointLimits.of(robot)
    lower, upper = (
        np.maximum(limits.lower, -_ASSUMED_LIMIT),
        np.minimum(limits.upper, _ASSUMED_LIMIT),
    )
    start = rng.uniform(lower[:, None], upper[:, None], (len(lower), _START_COUNT))
    position = np.zeros((3, _START_COUNT))
    position[0] = serial.reach * rng.uniform(*_OUTWARD, _START_COUNT)
    position[2] = serial.reach * rng.uniform(*_UP, _START_COUNT)
    position = np.round(position, 2)
    q, came = solve_poses(serial, _targets(position, base_from_tool), start, _ITERATIONS)
    q = (q + np.pi) % (2.0 * np.pi) - np.pi
    worth = np.where(came, _worth(serial, q, lower, upper), -np.inf)
    # The most bent ones of all that come there look alike at the corners: a few hundred suffice.
    best = np.argsort(-worth)[: max(20 * count, 200)]
    best = best[np.isfinite(worth[best])]
    corners = half_size * np.array(np.meshgrid(*[(-1.0, 1.0)] * 3)).reshape(3, -1, 1)
    around = (corners + position[:, None, best]).reshape(3, -1)
    near = np.tile(q[:, best], corners.shape[1])
    there, is_reached = solve_poses(serial, _targets(around, base_from_tool), near, _ITERATIONS)
    at_corners = np.where(is_reached, _worth(serial, there, lower, upper), -np.inf)
    least = np.minimum(worth[best], at_corners.reshape(corners.shape[1], len(best)).min(axis=0))
    order = np.argsort(-least)[:count]
    if not len(order) or least[order[0]] <= 0.0:
        raise PlanningError(
            f"{robot.name}: expected a place around which the untilted tool can be held on a part"
            f" of {2.0 * half_size:.2f} m, got none in {_START_COUNT} attempts{few_joints(len(lower))}"
        )
    return [
        PartPlacement(position[:, best[k]].copy(), q[:, best[k]].copy())
        for k in order
        if least[k] > 0.0
    ]


def _targets(position: np.ndarray, base_from_tool: Rotation) -> Targets:
    count = position.shape[1]
    tool = [np.repeat(column[:, None], count, axis=1) for column in base_from_tool.as_matrix().T]
    return Targets(position, tool, np.zeros((3, count)))


def _worth(serial: RigidRobot, q: np.ndarray, lower: np.ndarray, upper: np.ndarray) -> np.ndarray:
    """Return 1 for postures that are clear of everything, less for others, (n,)."""
    zero = np.zeros((3, q.shape[1]))
    at: FollowingRobot = following(serial, q, zero, TipMotion(zero, zero, zero, zero))
    clear = np.minimum(q - lower[:, None], upper[:, None] - q).min(axis=0)
    worth: np.ndarray = np.minimum(
        1.0, np.minimum(at.conditioning / _MIN_REGULARITY, clear / _MIN_LIMIT_DISTANCE)
    )
    return worth - _BEND_PENALTY * np.abs(q).sum(axis=0) / (2.0 * np.pi)
