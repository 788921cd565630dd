"""A robot's command as a CSV file: that of a run folder, or of anybody's program."""

from __future__ import annotations

import os
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from coupling.files.csv_table import POSE_COLUMNS
from coupling.files.measured_table import MeasuredTable
from coupling.path.histories import ToolPath
from coupling.path.joint_path import JointPath
from elastic_robot.errors import TrajectoryError
from elastic_robot.trajectory import Trajectory

# Larger angles are degrees, or no angles of a joint [rad]: four turns.
_MAX_JOINT_ANGLE = 8.0 * np.pi
# By how much the norm of a quaternion may differ from 1.
_NORM_TOLERANCE = 1e-3


@dataclass(frozen=True)
class CommandTable:
    """A command, and what its table says beside it.

    Attributes:
        joints: Motion of the drives.
        poses: Path of the undeflected tool at its rows; None where the table does not have all of it.
    """

    joints: JointPath
    poses: ToolPath | None


def read_command(file: Path, joints: int, error: type[Exception]) -> CommandTable:
    """Read time, q1.. and, where they are there, qd1.., qdd1.. and x, y, z, qx, qy, qz, qw.

    Args:
        file: CSV with SI units and radians; comments and other columns are ignored.
        joints: Number of the robot's joints.
        error: Exception class for every problem.
    """
    table = MeasuredTable.read(file, error)
    angles, rates, accelerations = (_names(letters, joints) for letters in ("q", "qd", "qdd"))
    table.require(("time", *angles))
    more = f"q{joints + 1}"
    if more in table.header:
        raise error(
            f"{file}: expected angles q1 to q{joints} of the robot's joints, got {more} too"
        )
    if not _ends(file):
        raise error(
            f"{file}: expected a line break at its end, got none: the last row may be cut off; add one"
            " if it is whole"
        )
    time = table.of(("time",))[:, 0]
    if len(time) < 2:
        raise error(f"{file}: expected at least two rows, got {len(time)}")
    falls = np.flatnonzero(np.diff(time) <= 0.0)
    if len(falls):
        before = f"{time[falls[0]]:.9g} s"
        raise table.row_error("time", int(falls[0]) + 1, f"more than the {before} before it")
    q = table.of(angles)
    for row, joint in np.argwhere(np.abs(q) > _MAX_JOINT_ANGLE):
        raise table.row_error(
            angles[joint], int(row), f"an angle in radians, of {_MAX_JOINT_ANGLE:.1f} at most"
        )
    moving = [block for block in (rates, accelerations) if any(n in table.header for n in block)]
    for block in moving:
        table.require_whole(block)
    if len(moving) == 1:
        raise error(
            f"{file}: expected rates qd1.. and accelerations qdd1.., or neither, got"
            f" {moving[0][0]}.. alone"
        )
    values = [table.of(block) for block in moving]
    try:
        Trajectory(time, q, *values)  # refuses what no robot can be simulated with
    except TrajectoryError as cause:
        reason = str(cause).removeprefix("trajectory: ")
        raise error(f"{file}: {reason}") from cause
    return CommandTable(JointPath(time, (q,), *((block,) for block in values)), _poses(table, time))


def _ends(file: Path) -> bool:
    """Return whether the last line of a file has an end; of a pipe nobody knows."""
    if not file.is_file():
        return True
    with file.open("rb") as stream:
        stream.seek(-1, os.SEEK_END)
        return stream.read(1) in b"\r\n"


def _names(letters: str, joints: int) -> tuple[str, ...]:
    return tuple(f"{letters}{i + 1}" for i in range(joints))


def _poses(table: MeasuredTable, time: np.ndarray) -> ToolPath | None:
    if not all(name in table.header for name in POSE_COLUMNS):
        return None
    rows = table.of(POSE_COLUMNS)
    for row in np.flatnonzero(np.abs(np.linalg.norm(rows[:, 3:], axis=1) - 1.0) > _NORM_TOLERANCE):
        raise table.row_error("qw", int(row), "the last part of a unit quaternion")
    return ToolPath(time, rows)
