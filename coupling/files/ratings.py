"""What a robot file rates its robot for; the model does not need it, so no FMU has it."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from pathlib import Path

from coupling.files.robot_schema import GearTorque, RobotFile, UrdfRobotFile
from coupling.files.toml_file import load_toml, validate
from elastic_robot.description import Robot
from elastic_robot.errors import RobotFileError


@dataclass(frozen=True)
class Ratings:
    """Loads that a robot is rated for.

    Attributes:
        payload: Rated load at the flange as a force [N]; None where the file does not know.
        gears: What the gears may carry, by the number of the joint, from 1; those that are known.
    """

    payload: float | None = None
    gears: Mapping[int, GearTorque] = field(default_factory=dict)


def load_ratings(path: Path, robot: Robot) -> Ratings:
    """Read the ratings of a robot file.

    Args:
        path: The file.
        robot: The robot that it describes, whose order of joints counts beside a URDF.

    Raises:
        RobotFileError: If the file cannot be read or does not have a robot file's keys.
    """
    data = load_toml(path, RobotFileError)
    schema: type[RobotFile | UrdfRobotFile] = UrdfRobotFile if "urdf" in data else RobotFile
    file = validate(data, schema, RobotFileError, str(path))
    numbers = list(range(1, len(file.joint) + 1))
    if isinstance(file, UrdfRobotFile):
        names = [joint.name for joint in robot.joints]
        numbers = [names.index(joint.name) + 1 for joint in file.joint]
    gears = {
        number: joint.gear_torque_Nm
        for number, joint in zip(numbers, file.joint, strict=True)
        if joint.gear_torque_Nm is not None
    }
    return Ratings(file.payload_N, gears)
