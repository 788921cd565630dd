"""Rated loads of a robot file; the model does not need them, so no FMU has them."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from pathlib import Path

from coupling.files.provenance import urdf_efforts
from coupling.files.robot_file import read_validated
from coupling.files.robot_schema import GearTorque, UrdfRobotFile
from coupling.files.urdf_elements import plain_name
from elastic_robot.description import Robot


@dataclass(frozen=True)
class Ratings:
    """Loads that a robot is rated for.

    Attributes:
        payload: Rated load at the flange as a force [N]; None where the file does not know.
        gears: Rated torques of the gears, by the number of the joint, from 1; those that are known.
        efforts: Highest torques of the joints after their URDF [N m], likewise; those of other gears.
    """

    payload: float | None = None
    gears: Mapping[int, GearTorque] = field(default_factory=dict)
    efforts: Mapping[int, float] = field(default_factory=dict)


def load_ratings(path: Path, robot: Robot) -> Ratings:
    """Read the ratings of a robot file.

    Args:
        robot: The robot that it describes, whose order of joints counts beside a URDF.
    """
    _, file = read_validated(path)
    efforts: dict[int, float] = {}
    if isinstance(file, UrdfRobotFile):  # its tables name joints in any order
        in_order = {joint.name: number for number, joint in enumerate(robot.joints, start=1)}
        rated = [
            (in_order[plain_name(rated_joint.name)], rated_joint.gear_torque_Nm)
            for rated_joint in file.joint
        ]
        efforts = urdf_efforts(path, file)
    else:
        rated = [(k, joint.gear_torque_Nm) for k, joint in enumerate(file.joint, start=1)]
    gears = {number: torque for number, torque in rated if torque is not None}
    return Ratings(
        file.payload_N,
        gears,
        {number: effort for number, effort in efforts.items() if number not in gears},
    )
