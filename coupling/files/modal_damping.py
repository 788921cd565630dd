"""Damping of gears and tilts by a damping ratio that all modes of a robot have in common.

A damper d_i beside each spring k_i gives mode v_k, v_k^T M v_k = 1, of frequency w_k the ratio

    zeta_k = sum_i d_i v_ik^2 / (2 w_k)

to first order in the dampers, as v_k^T D v_k = 2 zeta_k w_k.  The dampers are those with the least
squares of (zeta_k / zeta - 1) w_1 / w_k over all modes in several postures: slow modes, which move the
tool most, count most.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pinocchio as pin

from elastic_robot.chain import build_chain
from elastic_robot.description import Robot
from elastic_robot.parameters import Parameters

# Postures in which the dampers are fitted, between the joints' limits, at most this far from zero [rad].
_POSTURE_COUNT, _MAX_ANGLE, _SEED = 12, 1.5, 1
# A damper of a coordinate that moves alone, with the mean of its inertia, has that mode's ratio.  Each
# is at least and at most so many times as large, so that no gear swings undamped.
_MIN_FACTOR, _MAX_FACTOR = 0.2, 5.0


def with_damping_ratio(robot: Robot, ratio: float) -> Robot:
    """Return the robot with dampers that give all of its modes a damping ratio, as nearly as they can.

    Motors are locked and gears on a flank.  Modes change with the posture and dampers do not: over the
    workspace of the shipped robots 0.04 becomes 0.015 to 0.11 in the slowest three modes, with a median
    of 0.03 to 0.04.

    Args:
        ratio: Damping ratio of its modes [1], > 0.

    Raises:
        ElasticRobotError: If the robot cannot move as it is described.

    Example:
        >>> from coupling.files.robot_file import load_robot, shipped_robots
        >>> robot = load_robot(shipped_robots()["fanuc_r2000ic"])
        >>> round(with_damping_ratio(robot, 0.04).joints[0].damping)
        1753
    """
    stiffness = Parameters.of(robot).stiffness
    if len(stiffness) == 0:
        return robot
    dampers = iter(_fit_dampers(_inertias(robot), stiffness, ratio).tolist())
    joints = []
    for joint in robot.joints:
        damping = 0.0 if joint.stiffness is None else next(dampers)
        tilts = tuple(replace(tilt, damping=next(dampers)) for tilt in joint.tilt)
        joints.append(replace(joint, damping=damping, tilt=tilts))
    return replace(robot, joints=tuple(joints))


def _inertias(robot: Robot) -> np.ndarray:
    """Return mass matrices of the elastic coordinates in several postures [kg m^2], (p, m, m)."""
    chain = build_chain(robot)
    data, theta = chain.model.createData(), np.zeros(chain.model.nv)
    low, high = np.array([joint.limits or (-_MAX_ANGLE, _MAX_ANGLE) for joint in robot.joints]).T
    low, high = (
        np.maximum(low, np.minimum(high, -_MAX_ANGLE)),
        np.minimum(high, np.maximum(low, _MAX_ANGLE)),
    )
    postures = np.random.default_rng(_SEED).uniform(low, high, (_POSTURE_COUNT, len(low)))
    rows, masses = np.ix_(chain.elastic, chain.elastic), []
    for posture in postures:
        theta[chain.drive] = posture
        upper = np.triu(pin.crba(chain.model, data, theta))
        masses.append((upper + np.triu(upper, 1).T)[rows])
    return np.array(masses)


def _fit_dampers(mass: np.ndarray, stiffness: np.ndarray, ratio: float) -> np.ndarray:
    """Return the dampers of the elastic coordinates [N m s/rad], (m,).

    Args:
        mass: Mass matrices in several postures [kg m^2], (p, m, m).
        stiffness: Stiffness of the coordinates [N m/rad], (m,).
        ratio: Damping ratio that the modes are to have [1].
    """
    from scipy.linalg import eigh
    from scipy.optimize import lsq_linear

    inertia = np.mean(np.diagonal(mass, axis1=1, axis2=2), axis=0)
    alone = 2.0 * ratio * np.sqrt(stiffness * inertia)
    rows, targets = [], []
    for matrix in mass:
        squares, modes = eigh(np.diag(stiffness), matrix)
        omega = np.sqrt(squares)
        weight = omega[0] / omega
        rows.append(weight[:, None] * (modes**2).T / (2.0 * omega[:, None] * ratio) * alone)
        targets.append(weight)
    dampers: np.ndarray = (
        alone * lsq_linear(np.vstack(rows), np.concatenate(targets), (_MIN_FACTOR, _MAX_FACTOR)).x
    )
    return dampers
