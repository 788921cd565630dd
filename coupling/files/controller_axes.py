"""[controller] of a robot file: how the maker's controller counts its joints and lays its frames."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

import numpy as np
from scipy.spatial.transform import Rotation

from coupling.files.robot_schema import ControllerAxesTable
from coupling.files.toml_file import load_toml, validate
from elastic_robot.errors import RobotFileError

# Determinant below which no angles of the robot file belong to those of a controller.
_SINGULAR = 1e-9


@dataclass(frozen=True)
class ControllerAxes:
    """Joint angles and frames of a robot as its controller has them.

    Its angles are M q + q_0, with q the robot file's.

    Attributes:
        matrix: Matrix M of signs, and of joints counted from the horizontal, (joints, joints).
        offset: Angles q_0 [rad], (joints,).
        base_position: Origin of the controller's robot frame in the robot file's base, whose axes it
            has [m], (3,).
        last_from_flange: Rotation from the maker's flange frame to the last body's.
        flange_position: Origin of the flange frame in the last body's [m], (3,).
        stated: Whether the robot file says so; else all is as in the robot file.

    Example:
        >>> axes = ControllerAxes.as_described(2)
        >>> axes.controller_angles(np.array([[0.1, 0.2]])).tolist(), axes.stated
        ([[0.1, 0.2]], False)
    """

    matrix: np.ndarray
    offset: np.ndarray
    base_position: np.ndarray
    last_from_flange: Rotation
    flange_position: np.ndarray
    stated: bool

    @classmethod
    def as_described(cls, joints: int) -> ControllerAxes:
        """Return axes and frames as they are in a robot file."""
        none = np.zeros(3)
        return cls(np.eye(joints), np.zeros(joints), none, Rotation.identity(), none, False)

    def controller_angles(self, q: np.ndarray) -> np.ndarray:
        """Return the controller's angles of the robot file's, both [rad], (n, joints)."""
        return q @ self.matrix.T + self.offset

    def file_angles(self, angles: np.ndarray) -> np.ndarray:
        """Return the robot file's angles of the controller's, both [rad], (n, joints)."""
        return np.linalg.solve(self.matrix, (angles - self.offset).T).T


def controller_axes(path: Path, joints: int) -> ControllerAxes:
    """Return the controller's joint angles and frames of a robot, as its robot file says.

    Raises:
        RobotFileError: If the table does not fit.
    """
    data = load_toml(path, RobotFileError)
    if "controller" not in data:
        return ControllerAxes.as_described(joints)
    where = f"{path}: controller"
    table = validate(data["controller"], ControllerAxesTable, RobotFileError, where)
    matrix = (
        np.eye(joints) if table.joint_matrix is None else _matrix(table.joint_matrix, joints, where)
    )
    offset = (
        np.zeros(joints) if table.joint_offset_deg is None else np.array(table.joint_offset_deg)
    )
    if len(offset) != joints:
        raise RobotFileError(
            f"{where}: joint_offset_deg: expected {joints} angles, one for each joint, got {len(offset)}"
        )
    return ControllerAxes(
        matrix,
        np.deg2rad(offset),
        np.array(table.base_position),
        Rotation.from_euler("xyz", table.flange_rpy_deg, degrees=True),
        np.array(table.flange_position),
        True,
    )


def _matrix(rows: list[list[float]], joints: int, where: str) -> np.ndarray:
    sizes = [len(row) for row in rows]
    if sizes != [joints] * joints:
        raise RobotFileError(
            f"{where}: joint_matrix: expected {joints} rows of {joints} numbers, got rows of {sizes}"
        )
    matrix = np.array(rows)
    if abs(np.linalg.det(matrix)) < _SINGULAR:
        raise RobotFileError(
            f"{where}: joint_matrix: expected one that has an inverse, got {matrix.tolist()}"
        )
    return matrix
