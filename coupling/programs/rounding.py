"""Programs with the digits that their texts have, without a text."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import replace
from typing import Any

import numpy as np
from scipy.spatial.transform import Rotation

from coupling.programs.angles import abc_of
from coupling.programs.program import DEGREE_DECIMALS, HERE, MM_DECIMALS, ProgramMove, RobotProgram

# Function from rows to the same rows with the digits of a text.
RoundRows = Callable[[np.ndarray], np.ndarray]


def round_angles(poses: np.ndarray) -> np.ndarray:
    """Return poses whose rotations are written as three angles.

    Args:
        poses: Rows of x, y, z [m], qx, qy, qz, qw, (n, 7).
    """
    angles = round_single(abc_of(poses), DEGREE_DECIMALS)
    return np.hstack([_position(poses), Rotation.from_euler("ZYX", angles, degrees=True).as_quat()])


def round_quaternions(poses: np.ndarray, decimals: int) -> np.ndarray:
    """Return poses whose rotations are written as quaternions.

    Args:
        poses: Rows of x, y, z [m], qx, qy, qz, qw, (n, 7).
        decimals: Decimals of these.
    """
    quaternion = round_single(poses[:, 3:], decimals)
    quaternion /= np.linalg.norm(quaternion, axis=1, keepdims=True)
    return np.hstack([_position(poses), quaternion])


def round_program(
    program: RobotProgram,
    round_poses: RoundRows = round_angles,
    round_times: RoundRows | None = None,
) -> RobotProgram:
    """Return a program whose targets and frames are those of its text.

    Args:
        round_poses: Function that rounds the poses of its language, (n, 7).
        round_times: Function that rounds the times from target to target [s], (n,), where the text has
            fewer digits of them than are needed.

    Example:
        >>> program = RobotProgram("way", (ProgramMove("joint", joints=(0.123456789,)),))
        >>> np.rad2deg(round_program(program).moves[0].joints).round(8)
        array([7.07355022])
    """
    targets = [
        ProgramMove(move.motion, pose, joints, duration, move.speed, move.configuration)
        for move, pose, joints, duration in zip(
            program.moves,
            _round_given([move.pose for move in program.moves], round_poses),
            _round_given([move.joints for move in program.moves], _round_joints),
            _round_given([move.duration for move in program.moves], round_times),
            strict=True,
        )
    ]
    base, tool = round_poses(np.array([program.base or HERE, program.tool or HERE])).tolist()
    return replace(program, moves=tuple(targets), base=tuple(base), tool=tuple(tool))


def _round_given(values: Sequence[Any], round_rows: RoundRows | None) -> list[Any]:
    """Return targets or times, those that there are with the digits of a text."""
    rounded, given = list(values), [k for k, value in enumerate(values) if value is not None]
    if given and round_rows is not None:
        rows = round_rows(np.array([values[k] for k in given])).tolist()
        for k, row in zip(given, rows, strict=True):
            rounded[k] = tuple(row) if isinstance(row, list) else row
    return rounded


def _position(poses: np.ndarray) -> np.ndarray:
    return 1e-3 * round_single(1e3 * poses[:, :3], MM_DECIMALS)


def _round_joints(angles: np.ndarray) -> np.ndarray:
    return np.deg2rad(round_single(np.rad2deg(angles), DEGREE_DECIMALS))


def round_single(values: np.ndarray, decimals: int) -> np.ndarray:
    """Return numbers as a text has them and a controller keeps them, in single precision.

    Args:
        values: Any shape and unit.
        decimals: Decimals in the text.
    """
    return np.round(values, decimals).astype(np.float32).astype(float)
