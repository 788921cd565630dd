"""Torques of motors that move as recorded: (1 + eps') T + J q'' + f(s/a, q')."""

from __future__ import annotations

import numpy as np

from coupling.identification.motion.driven_fmu import GearMotion
from coupling.identification.motion.recording import Recording, SmoothedMotion
from coupling.inverse.servo import presliding
from elastic_robot.description import Robot
from elastic_robot.drive import Drive
from elastic_robot.kinematic_errors import KinematicErrors

# Rows at the start from which the friction's elongation there is estimated.
_FIRST = 25


def friction_part(
    recording: Recording, motion: SmoothedMotion, robot: Robot, gears: GearMotion
) -> np.ndarray:
    """Return motors' friction over its largest [1], (n, j), loaded at the start as torques there say."""
    felt = _felt(motion, robot, gears)
    part = np.zeros_like(felt)
    for i, joint in enumerate(robot.joints):
        drive = joint.drive
        if drive is None:
            continue
        started = 0.0
        if drive.friction > 0.0:
            needed = felt[:_FIRST, i] + drive.inertia * motion.qdd[:_FIRST, i]
            excess = np.mean(recording.torque[:_FIRST, i] - needed)
            started = float(np.clip(excess / drive.friction, -1.0, 1.0))
        part[:, i] = presliding(motion.q[:, i], drive.slip_angle, started)
    return part


def motor_torques(
    motion: SmoothedMotion, robot: Robot, gears: GearMotion, part: np.ndarray
) -> np.ndarray:
    """Return torques of motors [N m], (n, j), with a part of their friction [1], (n, j)."""
    torque = _felt(motion, robot, gears)
    for i, joint in enumerate(robot.joints):
        if joint.drive is not None:
            torque[:, i] += motor_losses(motion, i, joint.drive, gears.torque[:, i], part[:, i])
    return torque


def motor_losses(
    motion: SmoothedMotion, i: int, drive: Drive, gear_torque: np.ndarray, part: np.ndarray
) -> np.ndarray:
    """Return the torque of rotor and friction of joint i, from 0 [N m], (n,).

    Args:
        i: Index of the joint.
        gear_torque: Torque of its gear [N m], (n,).
        part: Its friction over its largest [1], (n,).
    """
    friction = drive.friction_torque(drive.friction, part, motion.qd[:, i], gear_torque)
    return drive.inertia * motion.qdd[:, i] + friction


def _felt(motion: SmoothedMotion, robot: Robot, gears: GearMotion) -> np.ndarray:
    """Return the gears' torques at their motors [N m], (n, j)."""
    return np.asarray(KinematicErrors.of(robot).slope(motion.q) * gears.torque)
