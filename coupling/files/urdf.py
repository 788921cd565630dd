"""URDF -> rigid joints in this project's frames, for the desk and the build; the FMU needs no URDF.

A URDF gives every joint a frame of its own, turned against the one before.  Here all body frames are
parallel to the base at zero angles, so the turns go into axes, centres of mass and inertias: with R
the rotation of a joint's frame at zero angles, axis -> R axis, com -> R com, inertia -> R inertia R^T.
"""

from __future__ import annotations

import importlib.util
import os
import sys
import tempfile
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path
from xml.etree import ElementTree

import numpy as np
import pinocchio as pin

from coupling.errors import one_of
from elastic_robot.description import Body, Joint
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
        >>> find_urdf("package://coupling/files/robots/icme2008.toml", Path()).name
        'icme2008.toml'
    """
    if not reference.startswith(_PACKAGE):
        path = folder / reference
        if not path.is_file():
            raise RobotFileError(
                f"{path}: no such file: name a URDF by its path from the robot file or as"
                f" {_PACKAGE}NAME/PATH"
            )
        return path
    name, _, rest = reference.removeprefix(_PACKAGE).partition("/")
    packages = [package for package in _package_folders(name) if package.is_dir()]
    for package in packages:
        if (package / rest).is_file():
            return package / rest
    if packages:
        raise RobotFileError(f"{reference}: there is no file {rest!r} in {packages[0]}")
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


@dataclass(frozen=True)
class UrdfChain:
    """The joints between two links of a URDF, rigid, in body frames parallel to the base.

    Attributes:
        joints: Base to tip, with the URDF's names, limits and maximum rates.
        base_from_joint: Placement of each joint's URDF frame at zero angles; it turns a direction
            given in that frame into base axes.
        base_from_tip: Placement of the tip link at zero angles.
    """

    joints: tuple[Joint, ...]
    base_from_joint: tuple[pin.SE3, ...]
    base_from_tip: pin.SE3


def read_urdf(file: Path, base: str | None, tip: str) -> UrdfChain:
    """Read the chain of revolute joints from one link of a URDF to another.

    Pinocchio merges what fixed joints hold together.  Joints that branch off the chain (a gripper's
    fingers) are locked at zero and their bodies added to the link that carries them; what lies
    before the base is left out, because it does not move.

    Args:
        file: The URDF.
        base: Link whose frame is the base frame; None for the root link.
        tip: Link behind the last joint.

    Raises:
        RobotFileError: If the file is no URDF, a link is not in it, or a joint between the two is
            neither revolute nor continuous, mimics another one or carries a body that cannot exist.
    """
    if file.suffix == ".xacro":
        raise RobotFileError(f"{file}: expected the URDF that xacro makes of it, got a xacro file")
    types = _joint_types(file)
    model = _parse(file)
    data = model.createData()
    # Columns: velocity of a joint's frame for a unit rate, root axes.
    jacobian = pin.computeJointJacobians(model, data, pin.neutral(model)).reshape(6, -1)
    pin.updateFramePlacements(model, data)
    tip_frame = _link(file, model, tip)
    base_frame = _link(file, model, base) if base is not None else _root_link(model)
    chain = _chain(file, model, types, base_frame, tip_frame)
    base_from_root = data.oMf[base_frame].inverse()
    base_from_joint = tuple(base_from_root * data.oMi[index] for index in chain)
    joints: list[Joint] = []
    center = np.zeros(3)
    for index, placement, carried in zip(
        chain, base_from_joint, _carried(model, data, chain), strict=True
    ):
        joint, name = model.joints[index], model.names[index]
        body_from_root = pin.SE3(np.eye(3), -placement.translation) * base_from_root
        inertia = body_from_root.act(carried)
        try:
            described = Joint(
                origin=tuple((placement.translation - center).tolist()),
                axis=tuple((base_from_root.rotation @ jacobian[3:, joint.idx_v]).tolist()),
                body=Body.from_matrix(inertia.mass, inertia.lever, inertia.inertia),
                limits=_limits(model, joint),
                max_rate=_max_rate(model, joint),
                name=name,
            )
        except ValueError as cause:
            raise RobotFileError(f"{file}: joint {name!r}: {cause}") from cause
        joints.append(described)
        center = placement.translation
    return UrdfChain(tuple(joints), base_from_joint, base_from_root * data.oMf[tip_frame])


def _chain(
    file: Path, model: pin.Model, types: dict[str, str], base_frame: int, tip_frame: int
) -> list[int]:
    """Return the numbers of the joints between two links, all of them driven rotations."""
    base, tip = model.frames[base_frame], model.frames[tip_frame]
    way = list(model.supports[tip.parentJoint])
    if base.parentJoint not in way:
        raise RobotFileError(
            f"{file}: expected a base between the root and {tip.name!r}, got {base.name!r}: name a"
            " link from which the tip moves"
        )
    chain = way[way.index(base.parentJoint) + 1 :]
    if not chain:
        raise RobotFileError(
            f"{file}: expected at least one joint between {base.name!r} and {tip.name!r}, got none"
        )
    for name in (model.names[index] for index in chain):
        if types[name] not in ("revolute", "continuous"):
            raise RobotFileError(
                f"{file}: joint {name!r}, between {base.name!r} and {tip.name!r}: expected revolute"
                f" or continuous, got {types[name]}"
            )
    return chain


def _carried(model: pin.Model, data: pin.Data, chain: list[int]) -> list[pin.Inertia]:
    """Return the inertia on each joint of the chain up to the next one, at zero angles, root axes."""
    bodies = {index: pin.Inertia.Zero() for index in chain}
    for index in range(1, model.njoints):
        carriers = [joint for joint in model.supports[index] if joint in bodies]
        if carriers:
            bodies[carriers[-1]] += data.oMi[index].act(model.inertias[index])
    return list(bodies.values())


def _limits(model: pin.Model, joint: pin.JointModel) -> tuple[float, float] | None:
    """Return the drive's range; None for a continuous joint, and for a range that is not stated."""
    if joint.nq != 1:  # Pinocchio keeps the cosine and sine of a continuous joint
        return None
    low, high = (
        float(limit[joint.idx_q]) for limit in (model.lowerPositionLimit, model.upperPositionLimit)
    )
    return None if low == high == 0.0 else (low, high)


def _max_rate(model: pin.Model, joint: pin.JointModel) -> float | None:
    rate = float(model.velocityLimit[joint.idx_v])
    return rate if 0.0 < rate < np.inf else None


def _link(file: Path, model: pin.Model, name: str) -> int:
    """Return the number of a link's frame."""
    if not model.existFrame(name, pin.FrameType.BODY):
        links = [frame.name for frame in model.frames if frame.type == pin.FrameType.BODY]
        raise RobotFileError(f"{file}: {one_of(links, name, kind='link ')}")
    return int(model.getFrameId(name, pin.FrameType.BODY))


def _root_link(model: pin.Model) -> int:
    return next(i for i, frame in enumerate(model.frames) if frame.type == pin.FrameType.BODY)


def _joint_types(file: Path) -> dict[str, str]:
    """Return the type of each joint by its name; "a mimic joint" for one that follows another."""
    try:
        root = ElementTree.parse(file).getroot()
    except (OSError, ElementTree.ParseError) as cause:
        raise RobotFileError(f"{file}: is not a URDF: {cause}") from cause
    return {
        joint.get("name", ""): (
            joint.get("type", "") if joint.find("mimic") is None else "a mimic joint"
        )
        for joint in root.findall("joint")
    }


def _parse(file: Path) -> pin.Model:
    """Return Pinocchio's model of a URDF."""
    with tempfile.TemporaryFile("w+", errors="replace") as said:
        # The parser is native code: it gives its reasons on the process's standard error only.
        sys.stderr.flush()
        standard_error = os.dup(2)
        os.dup2(said.fileno(), 2)
        try:
            model = pin.buildModelFromUrdf(str(file))
        except ValueError:
            model = None
        finally:
            os.dup2(standard_error, 2)
            os.close(standard_error)
        said.seek(0)
        reasons = [line.partition(":")[2].strip() for line in said if line.startswith("Error:")]
    # An inertia that cannot be read is left out of the model, without an exception.
    if model is None or any("inertial" in reason.lower() for reason in reasons):
        raise RobotFileError(f"{file}: is not a URDF: {'; '.join(reasons)}")
    return model
