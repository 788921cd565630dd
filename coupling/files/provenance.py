"""What a robot file tells beyond the model: sources of its numbers, how sure they are, ratings."""

from __future__ import annotations

import hashlib
from collections.abc import Iterator, Mapping
from dataclasses import dataclass, field
from pathlib import Path

from coupling.files.robot_file import read_validated, rigid_joints, urdf_of
from coupling.files.robot_schema import GearTorque, UrdfRobotFile
from coupling.files.sources import Number, numbers
from coupling.files.urdf_elements import plain_name
from elastic_robot.description import Joint, Robot
from elastic_robot.errors import RobotFileError

# Links of the same mass from which on it is taken for a placeholder.
_PLACEHOLDER_COUNT = 3


@dataclass(frozen=True)
class Ratings:
    """Loads that a robot is rated for; the model does not need them, so no FMU has them.

    Attributes:
        payload: Rated load at the flange as a force [N]; None where the file does not know.
        gears: Rated torques of the gears, by the number of the joint, from 1; those that are known.
        efforts: Highest torques of the joints after their URDF [N m], likewise; those of other gears.
    """

    payload: float | None = None
    gears: Mapping[int, GearTorque] = field(default_factory=dict)
    efforts: Mapping[int, float] = field(default_factory=dict)


@dataclass(frozen=True)
class Provenance:
    """Where a robot's numbers are from, and how sure they are.

    Attributes:
        files: Checksums of the files that describe it, by their names.
        stiffness_ranges: Lowest and highest stiffness of the gears that are not known better [N m/rad],
            by the number of the joint, from 1.
        remarks: Sentences on what its URDF lacks, or what cannot be meant.
        numbers: Numbers of its file, without its URDF's.
        servos_confirmed: Whether measurements confirm its servos, as its file has it.
    """

    files: Mapping[str, str] = field(default_factory=dict)
    stiffness_ranges: Mapping[int, tuple[float, float]] = field(default_factory=dict)
    remarks: tuple[str, ...] = ()
    numbers: tuple[Number, ...] = ()
    servos_confirmed: bool = True
    ratings: Ratings = field(default_factory=Ratings)

    @property
    def stiffness_range(self) -> tuple[float, float] | None:
        """Lowest and highest of all ranges; None where every stiffness is the robot's."""
        ranges = self.stiffness_ranges.values()
        return (min(ranges)[0], max(high for _, high in ranges)) if ranges else None


def load_provenance(path: Path, robot: Robot) -> Provenance:
    """Return the provenance of a robot file's numbers.

    Args:
        robot: The robot that it describes, whose order of joints counts beside a URDF.
    """
    data, file = read_validated(path)
    files, remarks, efforts = [path], list[str](), dict[int, float]()
    joints = dict(enumerate(file.joint, start=1))
    if isinstance(file, UrdfRobotFile):  # its tables name joints in any order
        source, chain = urdf_of(path, file)
        files.append(source)
        in_order = {joint.name: number for number, joint in enumerate(robot.joints, start=1)}
        joints = {in_order[plain_name(joint.name)]: joint for joint in file.joint}
        remarks = list(_remarks(path, file))
        efforts = dict(enumerate(chain.efforts, start=1))
    gears = {k: joint.gear_torque_Nm for k, joint in joints.items() if joint.gear_torque_Nm}
    efforts = {k: effort for k, effort in efforts.items() if effort > 0.0 and k not in gears}
    ranges = {k: joint.stiffness_range for k, joint in joints.items() if joint.stiffness_range}
    return Provenance(
        {file_read.name: _checksum(file_read) for file_read in files},
        {number: (low, high) for number, (low, high) in ranges.items()},
        tuple(remarks),
        tuple(numbers(data)),
        file.servos_confirmed,
        Ratings(file.payload_N, gears, efforts),
    )


def urdf_numbers(path: Path) -> list[Number]:
    """Return the numbers that a robot takes from its URDF; none where its file names none."""
    _, file = read_validated(path)
    if not isinstance(file, UrdfRobotFile):
        return []
    source, chain = urdf_of(path, file)
    tables = {plain_name(joint.name): joint for joint in file.joint}
    scaled = "" if file.urdf.mass_scale == 1.0 else f", times mass_scale {file.urdf.mass_scale:g}"
    listed = []
    for (joint, remark), effort in zip(rigid_joints(path, file, chain), chain.efforts, strict=True):
        table, body = tables.get(joint.name), joint.body
        values = {
            "limits": (joint.limits and list(joint.limits), "limits"),
            "max_rate": (joint.max_rate, "max_rate"),
            "effort": (effort, "gear_torque_Nm"),
            "mass": (body.mass, "mass"),
            "com": (list(body.com), "com"),
            "inertia": (list(body.inertia), "inertia"),
        }
        for key, (value, replaced_by) in values.items():
            if table is not None and getattr(table, replaced_by) is not None:
                continue  # listed as the robot file's
            heavy = key in ("mass", "com", "inertia")
            shown: object = value
            text = f"URDF {source.name}{scaled if heavy else ''}"
            if value is None or (key in ("effort", "mass") and value == 0.0):
                text, shown = f"not in the URDF {source.name}", "none"
            elif heavy and body.mass == 0.0:
                continue
            elif key == "inertia" and remark:
                text += f"; {remark}"
            listed.append(Number(f"joint {joint.name!r}: {key}", shown, text))
    return listed


def _remarks(path: Path, file: UrdfRobotFile) -> Iterator[str]:
    """Yield what is to say of a robot's URDF."""
    source, chain = urdf_of(path, file)
    joints = list(rigid_joints(path, file, chain))
    for joint, remark in joints:
        if remark:
            yield f"{source.name}: joint {joint.name!r}: {remark}"
    for joint, effort in zip(chain.joints, chain.efforts, strict=True):
        if effort < 0.0:
            yield (
                f"{source.name}: joint {joint.name!r}: effort: expected >= 0 N m, got {effort:g}: it is"
                " not used as a limit"
            )
    limited = {plain_name(joint.name) for joint in file.joint if joint.limits}
    for name in chain.unlimited:
        if name not in limited:
            yield (
                f"{source.name}: joint {name!r}: limits: expected a range of a revolute joint, got none:"
                " it turns without end here; give limits in [[joint]]"
            )
    bare = [joint for joint, _ in joints if joint.body.mass == 0.0]
    if bare:
        yield (
            f"{source.name}: no mass behind {joint_names(bare)}: what moves there weighs nothing; give"
            " mass, com and inertia in [[joint]] if that is not so"
        )
    replaced = {plain_name(joint.name) for joint in file.joint if joint.mass is not None}
    values = set(chain.masses.values())
    if (
        len(chain.masses) >= _PLACEHOLDER_COUNT
        and len(values) == 1
        and replaced < {chain_joint.name for chain_joint in chain.joints}
    ):
        yield (
            f"{source.name}: all {len(chain.masses)} links that move have the same mass,"
            f" {values.pop():g} kg, which no robot has: gravity sag and motion mean nothing until mass,"
            " com and inertia are given in [[joint]]"
        )


def joint_names(joints: list[Joint]) -> str:
    """Return names of joints in words."""
    return f"joint{'s' * (len(joints) > 1)} {', '.join(repr(joint.name) for joint in joints)}"


def _checksum(file: Path) -> str:
    try:
        return f"sha256 {hashlib.sha256(file.read_bytes()).hexdigest()[:16]}"
    except OSError as cause:
        raise RobotFileError(f"{file}: cannot be read: {cause}") from cause
