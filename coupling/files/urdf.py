"""URDF -> rigid joints in this project's frames, for the desk and the build; the FMU needs no URDF.

A URDF gives every joint a frame of its own, turned against the one before.  Here all body frames are
parallel to the base at zero angles, so the turns go into axes, centres of mass and inertias: with R
the rotation of a joint's frame at zero angles, axis -> R axis, com -> R com, inertia -> R inertia R^T.
"""

from __future__ import annotations

import importlib.util
import os
import sys
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np
import pinocchio as pin

from coupling.files.urdf_tree import ROTATIONS, TreeJoint, UrdfTree, read_tree
from elastic_robot.body import Body
from elastic_robot.description import Joint
from elastic_robot.errors import RobotFileError

_PACKAGE = "package://"


def find_urdf(reference: str, folder: Path) -> Path:
    """Return the file that a robot file calls its URDF.

    Args:
        reference: A path, relative to `folder`, or package://NAME/PATH with the name of a Python
            package, a ROS package (ROS_PACKAGE_PATH, AMENT_PREFIX_PATH) or one of Pinocchio's data
            packages (cmeel), looked up in the order ROS, Python, cmeel.
        folder: Folder of the robot file.

    Raises:
        RobotFileError: If there is no such package or file.

    Example:
        >>> find_urdf("package://elastic_robot/py.typed", Path()).name
        'py.typed'
    """
    if not reference.startswith(_PACKAGE):
        path = folder / reference
        if not path.is_file():
            raise RobotFileError(
                f"{path}: no such file: name a URDF by its path from the robot file or as"
                f" {_PACKAGE}NAME/PATH"
            )
        return path
    name, _, path_in_package = reference.removeprefix(_PACKAGE).partition("/")
    packages = [package for package in _package_folders(name) if package.is_dir()]
    for package in packages:
        if (package / path_in_package).is_file():
            return package / path_in_package
    if packages:
        raise RobotFileError(f"{reference}: there is no file {path_in_package!r} in {packages[0]}")
    raise RobotFileError(
        f"{reference}: no package {name!r} is installed: expected an importable Python package or a"
        " folder of that name on ROS_PACKAGE_PATH or AMENT_PREFIX_PATH"
    )


def _package_folders(name: str) -> Iterator[Path]:
    """Yield the folders in which a package of that name may be."""
    for entry in os.environ.get("ROS_PACKAGE_PATH", "").split(os.pathsep):
        if entry:
            yield Path(entry, name)
    for entry in os.environ.get("AMENT_PREFIX_PATH", "").split(os.pathsep):
        if entry:
            yield Path(entry, "share", name)
    spec = importlib.util.find_spec(name) if name.isidentifier() else None
    for location in (spec.submodule_search_locations or []) if spec else []:
        yield Path(location)
    for entry in sys.path:
        yield Path(entry, "cmeel.prefix", "share", name)


_NO_BODY = Body(0.0, (0.0, 0.0, 0.0), (0.0, 0.0, 0.0))


@dataclass(frozen=True)
class UrdfChain:
    """The joints between two links of a URDF, rigid, in body frames parallel to the base.

    Attributes:
        joints: Base to tip, with the URDF's names, limits and maximum rates, without bodies.
        inertias: Mass, centre and inertia about it of what each carries up to the next one, in its body
            frame, as the URDF has them.
        base_from_joint: Placement of each joint's URDF frame at zero angles; it turns a direction
            given in that frame into base axes.
        base_from_tip: Placement of the tip link at zero angles.
        efforts: Highest torque of each joint as it is written; 0 where there is none [N m].
        masses: Masses of the links that move, by name [kg].
        unlimited: Names of the revolute joints without a range.
    """

    joints: tuple[Joint, ...]
    inertias: tuple[pin.Inertia, ...]
    base_from_joint: tuple[pin.SE3, ...]
    base_from_tip: pin.SE3
    efforts: tuple[float, ...]
    masses: dict[str, float]
    unlimited: tuple[str, ...]


def read_urdf(file: Path, base: str | None, tip: str) -> UrdfChain:
    """Read the chain of revolute joints from one link of a URDF to another.

    Fixed joints are merged.  Joints that branch off the chain (a gripper's fingers) are locked at zero
    and their bodies added to the link that carries them; what lies before the base, or is fixed to it,
    is left out, because it does not move.

    Args:
        base: Link whose frame is the base frame; None for the root link.
        tip: Link behind the last joint.

    Raises:
        RobotFileError: If the file is no URDF, a link is not in it, a joint between the two is neither
            revolute nor continuous or mimics another one, or a number of a body that moves is missing.
    """
    if file.suffix == ".xacro":
        raise RobotFileError(
            f"{file}: expected the URDF that xacro makes of it, got a xacro file: elastic-robot init"
            f" --robot {file.name} converts it"
        )
    tree = read_tree(file)
    try:
        tip = tree.link(tip)
        base = tree.root if base is None else tree.link(base)
        way = tree.way(base, tip)
        driven = _turning_joints(way, base, tip)
        return _chain(tree, way, driven)
    except ValueError as cause:
        raise RobotFileError(f"{file}: {cause}") from cause


def _turning_joints(way: Sequence[TreeJoint], base: str, tip: str) -> list[TreeJoint]:
    """Return the joints of a way that turn; the others of it are fixed."""
    moving = [joint for joint in way if joint.kind != "fixed"]
    turning = [joint for joint in moving if joint.is_rotation]
    if not moving:
        raise ValueError(f"expected at least one joint between {base!r} and {tip!r}, got none")
    for number, joint in enumerate(moving):
        if joint.is_rotation:
            continue
        got = f"a mimic joint of {joint.mimics!r}" if joint.mimics else joint.kind
        remedy = f"set [urdf] base = {joint.child!r}, where it carries the robot"
        if any(before.is_rotation for before in moving[:number]):
            remedy = (
                f"set [tcp] link = {joint.parent!r}, the link before it, and give the tool's place from"
                " there as its position; what is behind is carried at zero"
            )
        raise ValueError(
            f"joint {joint.name!r}, between {base!r} and {tip!r}: expected"
            f" {' or '.join(ROTATIONS)}, got {got}: {remedy}"
        )
    return turning


def _chain(tree: UrdfTree, way: Sequence[TreeJoint], driven: Sequence[TreeJoint]) -> UrdfChain:
    """Return the chain of a way's joints."""
    base_from_link, placements = pin.SE3.Identity(), dict[str, pin.SE3]()
    for joint in way:
        base_from_link = base_from_link * joint.parent_from_joint
        placements[joint.name] = base_from_link
    joints: list[Joint] = []
    inertias, masses = [], dict[str, float]()
    centre = np.zeros(3)
    on_way = {joint.name for joint in driven}
    for joint in driven:
        placement = placements[joint.name]
        inertia = pin.Inertia.Zero()
        for link, joint_from_link in tree.rigid_links(joint.child, on_way):
            body = tree.inertia(link)
            if body.mass > 0.0:
                masses[link] = body.mass
            inertia += joint_from_link.act(body)
        rotated = pin.SE3(placement.rotation, np.zeros(3)).act(inertia)
        try:
            joints.append(
                Joint(
                    origin=tuple((placement.translation - centre).tolist()),
                    axis=tuple((placement.rotation @ joint.axis).tolist()),
                    body=_NO_BODY,
                    limits=joint.limits,
                    max_rate=joint.max_rate,
                    name=joint.name,
                )
            )
        except ValueError as cause:
            raise ValueError(f"joint {joint.name!r}: {cause}") from cause
        inertias.append(rotated)
        centre = placement.translation
    return UrdfChain(
        tuple(joints),
        tuple(inertias),
        tuple(placements[joint.name] for joint in driven),
        base_from_link,
        tuple(joint.effort for joint in driven),
        masses,
        tuple(
            driven_joint.name
            for driven_joint in driven
            if driven_joint.kind == "revolute" and driven_joint.limits is None
        ),
    )
