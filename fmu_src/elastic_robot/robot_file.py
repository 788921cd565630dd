"""robot.toml -> Robot, for the desk and the build; inside the FMU the robot arrives as JSON."""

from __future__ import annotations

from importlib import resources
from pathlib import Path
from typing import Annotated

import numpy as np
from pydantic import Field

from elastic_robot.chain import build_chain
from elastic_robot.description import Body, Joint, Robot, Tilt
from elastic_robot.errors import ElasticRobotError, RobotFileError
from elastic_robot.spline_curve import akima
from elastic_robot.toml_file import Schema, nearest, read_toml

Vector3 = Annotated[list[float], Field(min_length=3, max_length=3)]
Pair = Annotated[list[float], Field(min_length=2, max_length=2)]


class _Body(Schema):
    mass: float
    com: Vector3
    inertia: Annotated[list[float], Field(min_length=3, max_length=6)]

    def body(self) -> Body:
        return Body(self.mass, tuple(self.com), tuple(self.inertia))


class _Tilt(Schema):
    axis: Vector3
    stiffness: float
    damping: float = 0.0


class _Joint(_Body):
    name: str = ""
    origin: Vector3
    axis: Vector3
    stiffness: float | None = None
    damping: float = 0.0
    backlash: float = 0.0
    tilt: list[_Tilt] = []
    limits: Pair | None = None
    max_rate: float | None = None
    torque_table: list[Pair] | None = None


class _Tcp(Schema):
    position: Vector3
    rpy: Vector3 = [0.0, 0.0, 0.0]


class _RobotFile(Schema):
    name: str
    gravity: Vector3 = [0.0, 0.0, -9.81]
    tcp: _Tcp
    joint: Annotated[list[_Joint], Field(min_length=1)]
    payload: _Body | None = None


def shipped_robots() -> dict[str, Path]:
    """Return the robot files that come with the package, by name."""
    folder = Path(str(resources.files("elastic_robot"))) / "robots"
    return {file.stem: file for file in sorted(folder.glob("*.toml"))}


def find_robot(name_or_path: str, folder: Path | None = None) -> Path:
    """Return the file of a shipped robot's name, or of a path (relative to `folder`).

    Raises:
        RobotFileError: If there is neither.
    """
    shipped = shipped_robots()
    if name_or_path in shipped:
        return shipped[name_or_path]
    path = (folder or Path()) / name_or_path
    if not path.is_file():
        raise RobotFileError(
            f"{name_or_path}: no such robot file, and no shipped robot of that name;"
            f" {nearest(name_or_path, list(shipped))}"
        )
    return path


def load_robot(path: str | Path) -> Robot:
    """Read a robot description (format: docs/robot_file.md) and validate it completely.

    Args:
        path: The robot.toml, all values in SI units.

    Returns:
        The robot.

    Raises:
        RobotFileError: With file, joint, key, value found and what is needed.

    Example:
        >>> load_robot(shipped_robots()["icme2008"]).name
        'icme2008-example'
    """
    path = Path(path)
    file = read_toml(path, _RobotFile, RobotFileError)
    joints = []
    for number, joint in enumerate(file.joint, start=1):
        where = f"{path}: joint {number}" + (f" ({joint.name!r})" if joint.name else "")
        joints.append(_joint(joint, where))
    try:
        payload = file.payload.body() if file.payload else None
    except ValueError as cause:
        raise RobotFileError(f"{path}: payload: {cause}") from cause
    try:
        robot = Robot(
            name=file.name,
            joints=tuple(joints),
            gravity=tuple(file.gravity),
            tcp_position=tuple(file.tcp.position),
            tcp_rpy=tuple(file.tcp.rpy),
            payload=payload,
        )
        build_chain(robot)  # finds elastic coordinates that move no inertia
    except (ValueError, ElasticRobotError) as cause:
        raise RobotFileError(f"{path}: {cause}") from cause
    return robot


def _joint(joint: _Joint, where: str) -> Joint:
    tilts = []
    for number, tilt in enumerate(joint.tilt, start=1):
        try:
            tilts.append(Tilt(tuple(tilt.axis), tilt.stiffness, tilt.damping))
        except ValueError as cause:
            raise RobotFileError(f"{where}: tilt {number}: {cause}") from cause
    try:
        described = Joint(
            origin=tuple(joint.origin),
            axis=tuple(joint.axis),
            body=joint.body(),
            stiffness=joint.stiffness,
            damping=joint.damping,
            backlash=joint.backlash,
            tilt=tuple(tilts),
            limits=(joint.limits[0], joint.limits[1]) if joint.limits else None,
            max_rate=joint.max_rate,
            torque_table=tuple((a, t) for a, t in joint.torque_table or []) or None,
            name=joint.name,
        )
        if described.torque_table:
            akima(*np.array(described.torque_table).T)  # refuses a curve that falls in between
        return described
    except ValueError as cause:
        raise RobotFileError(f"{where}: {cause}") from cause
