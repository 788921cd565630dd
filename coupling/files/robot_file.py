"""robot.toml -> Robot, for the desk and the build; inside the FMU the robot arrives as JSON.

A robot file either describes the rigid robot itself or names a URDF that does, and adds what gives
way: stiffness, damping, backlash and tilts.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import replace
from importlib import resources
from pathlib import Path
from typing import Any

import numpy as np
import pinocchio as pin

from coupling.errors import locate_errors, one_of
from coupling.files.balancer_table import BalancerGeometry, gas_spring_points
from coupling.files.drive_table import drive_in_words
from coupling.files.gear_table import errors_in_words
from coupling.files.modal_damping import with_damping_ratio
from coupling.files.robot_schema import (
    BodyTable,
    JointElasticity,
    RobotFile,
    UrdfJoint,
    UrdfRobotFile,
    damping_ratio,
)
from coupling.files.sources import Number, numbers, require_places
from coupling.files.toml_file import load_toml, require_kind, validate
from coupling.files.urdf import UrdfChain, find_urdf, read_urdf
from coupling.files.urdf_bodies import body_of
from coupling.files.urdf_elements import plain_name
from elastic_robot.body import Body
from elastic_robot.chain import build_chain
from elastic_robot.description import Joint, Robot, Table, Tilt
from elastic_robot.errors import ElasticRobotError, RobotFileError
from elastic_robot.spline_curve import akima


def shipped_robots() -> dict[str, Path]:
    """Return the robot files that come with the package, by name.

    Those of the examples are among them: a wheel has them beside the others, a checkout where they are.
    """
    package = Path(str(resources.files(__package__)))
    folders, checkout = [package / "robots"], package.parents[1]
    if (checkout / "pyproject.toml").is_file():
        folders.append(checkout / "examples" / "robots")
    files = [file for folder in folders for file in folder.glob("*.toml")]
    return {file.stem: file for file in sorted(files, key=lambda file: file.stem)}


def find_robot(name_or_path: str, folder: Path | None = None) -> Path:
    """Return the file of a shipped robot's name, or of a path (relative to `folder`)."""
    shipped = shipped_robots()
    if name_or_path in shipped:
        return shipped[name_or_path]
    path = (folder or Path()) / name_or_path
    try:
        exists = path.is_file()
    except (OSError, ValueError):  # a name that no file can have
        exists = False
    if not exists:
        raise RobotFileError(one_of(shipped, name_or_path, also=" or the path of a robot file"))
    return path


def robot_numbers(path: Path) -> tuple[str, list[Number]]:
    """Return a robot's name and every number of its file with its source; a URDF is not opened."""
    data, file = read_validated(path)
    with locate_errors(str(path), ValueError, RobotFileError):
        require_places(data)
    return file.name, numbers(data)


def parts_in_words(path: Path) -> list[str]:
    """Return a line for each hysteresis, kinematic error, drive and balancer; a URDF is not opened."""
    lines = []
    for number, joint in enumerate(read_validated(path)[1].joint, start=1):
        with locate_errors(f"{path}: joint {number}", ValueError, RobotFileError):
            (backlash, elements), drive = joint.hysteresis(), joint.motor()
            errors = joint.kinematic_errors()
        place = f"joint[{number}]"
        if elements:
            each = ", ".join(f"{e.slip_torque:.4g} N m at {e.slip_angle:.4g} rad" for e in elements)
            whole = sum(element.slip_torque for element in elements)
            lines.append(
                f"{place}.gear: hysteresis {whole:.4g} N m ({each}), backlash {backlash:.4g} rad"
            )
        if errors:
            lines.append(f"{place}.gear: kinematic error {errors_in_words(errors)}")
        if drive is not None:
            lines.append(f"{place}.drive, at the gear's output: {drive_in_words(drive)}")
        if joint.balancer is not None:
            lines.append(f"{place}.balancer: {joint.balancer.in_words()}")
    return lines


def read_validated(path: Path) -> tuple[dict[str, Any], RobotFile | UrdfRobotFile]:
    """Return the content of a robot file, as it is parsed and as its keys."""
    if path.suffix.lower() in (".urdf", ".xacro", ".xml", ".mjcf"):
        raise RobotFileError(
            f"{path}: expected a robot file, got a description without gears:"
            f" elastic-robot init cell --robot {path} writes its robot file"
        )
    data = load_toml(path, RobotFileError)
    require_kind(data, "robot file", path, RobotFileError)
    schema: type[RobotFile | UrdfRobotFile] = UrdfRobotFile if "urdf" in data else RobotFile
    return data, validate(data, schema, RobotFileError, str(path))


def load_robot(path: str | Path) -> Robot:
    """Read a robot description (format: docs/robot_file.md) and validate it completely.

    Raises:
        RobotFileError: With file, joint, key, what was expected and what was got.

    Example:
        >>> load_robot(shipped_robots()["icme2008"]).name
        'icme2008-example'
    """
    path = Path(path)
    data, file = read_validated(path)
    try:
        robot = _complete(path, file) if isinstance(file, RobotFile) else _with_urdf(path, file)
        require_places(data)
        _require_inertia(robot, "urdf" in data)
        ratio = damping_ratio(file)
        if ratio is not None:
            robot = with_damping_ratio(robot, ratio)
    except RobotFileError:
        raise
    except (ValueError, ElasticRobotError) as cause:
        raise RobotFileError(f"{path}: {cause}") from cause
    return robot


def _require_inertia(robot: Robot, has_urdf: bool) -> None:
    """Refuse elastic coordinates that move no inertia."""
    try:
        build_chain(robot)
    except ElasticRobotError as cause:
        bare = [repr(joint.name) for joint in robot.joints if joint.body.mass == 0.0]
        if not (has_urdf and bare):
            raise
        raise ElasticRobotError(
            f"{cause}; there is no mass behind {', '.join(bare)} in the URDF: write mass, com and"
            " inertia, in the joint's frame, into [[joint]] of the robot file (elastic-robot init"
            " --robot FILE.urdf writes estimates)"
        ) from cause


def axes_of_file(path: Path) -> list[np.ndarray]:
    """Return the rotation base_from_file of the tilts' axes of each joint, (3, 3) each."""
    _, file = read_validated(path)
    if isinstance(file, RobotFile):
        return [np.eye(3)] * len(file.joint)
    _, chain = urdf_of(path, file)
    return [base_from_joint.rotation for base_from_joint in chain.base_from_joint]


def _complete(path: Path, file: RobotFile) -> Robot:
    joints, link_rotation = [], np.eye(3)
    for number, joint in enumerate(file.joint, start=1):
        where = f"{path}: joint {number}" + (f" ({joint.name!r})" if joint.name else "")
        with locate_errors(where, ValueError, RobotFileError):
            rigid = Joint(tuple(joint.origin), tuple(joint.axis), joint.body(), name=joint.name)
        joints.append(_elastic(rigid, joint, link_rotation, link_rotation, where))
    return Robot(
        name=file.name,
        joints=tuple(joints),
        gravity=tuple(file.gravity),
        tcp_position=tuple(file.tcp.position),
        tcp_rpy=tuple(file.tcp.rpy),
        payload=_payload(file.payload, pin.SE3.Identity(), path),
    )


def _with_urdf(path: Path, file: UrdfRobotFile) -> Robot:
    """Return the robot of a URDF with the elasticities of a file."""
    _, chain = urdf_of(path, file)
    keys = _by_name(file.joint, chain, path)
    joints, before = [], np.eye(3)
    for (rigid, _), base_from_joint in zip(
        rigid_joints(path, file, chain), chain.base_from_joint, strict=True
    ):
        rotation, joint = base_from_joint.rotation, rigid
        if rigid.name in keys:
            where = f"{path}: joint {rigid.name!r}"
            joint = _elastic(rigid, keys[rigid.name], rotation, before, where)
        joints.append(joint)
        before = rotation
    # The last body's frame has its origin on the last axis and is parallel to the base.
    last_from_base = pin.SE3(np.eye(3), -chain.base_from_joint[-1].translation)
    last_from_tip = last_from_base * chain.base_from_tip
    tip_from_tool = pin.SE3(pin.rpy.rpyToMatrix(*file.tcp.rpy), np.array(file.tcp.position))
    last_from_tool = last_from_tip * tip_from_tool
    return Robot(
        name=file.name,
        joints=tuple(joints),
        gravity=tuple(file.gravity),
        tcp_position=tuple(last_from_tool.translation.tolist()),
        tcp_rpy=tuple(pin.rpy.matrixToRpy(last_from_tool.rotation).tolist()),
        payload=_payload(file.payload, last_from_tip, path),
    )


def urdf_of(path: Path, file: UrdfRobotFile) -> tuple[Path, UrdfChain]:
    """Return the URDF of a robot file, and its chain of joints."""
    with locate_errors(str(path), RobotFileError):
        urdf = find_urdf(file.urdf.file, path.parent)
        return urdf, read_urdf(urdf, file.urdf.base, file.tcp.link)


def rigid_joints(path: Path, file: UrdfRobotFile, chain: UrdfChain) -> Iterator[tuple[Joint, str]]:
    """Yield the rigid joints of a robot file's URDF with their bodies, and a remark on each, or ""."""
    keys = _by_name(file.joint, chain, path)
    parts = zip(chain.joints, chain.inertias, chain.base_from_joint, strict=True)
    for number, (joint, inertia, base_from_joint) in enumerate(parts):
        table = keys.get(joint.name)
        # The first body turns about its joint's axis only, unless this tilts.
        alone = number == 0 and not (table and table.tilt)
        with locate_errors(f"{path}: joint {joint.name!r}", ValueError, RobotFileError):
            body, remark = body_of(
                inertia,
                file.urdf.mass_scale,
                table,
                base_from_joint.rotation,
                np.array(joint.axis) if alone else None,
            )
        yield replace(joint, body=body), remark


def _by_name(joints: list[UrdfJoint], chain: UrdfChain, path: Path) -> dict[str, UrdfJoint]:
    names = [joint.name for joint in chain.joints]
    keys: dict[str, UrdfJoint] = {}
    for joint in joints:
        name = plain_name(joint.name)
        if name not in names:
            raise RobotFileError(
                f"{path}: joint: {one_of(names, joint.name, ' (the joints between base and TCP)')}"
            )
        if name in keys:
            raise RobotFileError(f"{path}: joint {joint.name!r}: expected one table, got two")
        keys[name] = joint
    return keys


def _elastic(
    rigid: Joint,
    keys: JointElasticity,
    base_from_file: np.ndarray,
    base_from_previous: np.ndarray,
    where: str,
) -> Joint:
    """Return a joint that gives way.

    Args:
        base_from_file: Rotation from the axes of its tilts, and of its link, in the file, (3, 3).
        base_from_previous: Rotation from those of the link before it, (3, 3).
    """
    tilts = []
    for number, tilt in enumerate(keys.tilt, start=1):
        with locate_errors(f"{where}: tilt {number}", ValueError, RobotFileError):
            elastic_tilt = Tilt(tuple(tilt.axis), tilt.stiffness, tilt.damping)
        tilts.append(
            replace(elastic_tilt, axis=tuple((base_from_file @ elastic_tilt.axis).tolist()))
        )
    with locate_errors(where, ValueError, RobotFileError):
        elastic = replace(
            rigid,
            stiffness=keys.stiffness,
            damping=keys.damping,
            backlash=keys.backlash,
            tilt=tuple(tilts),
            limits=(keys.limits[0], keys.limits[1]) if keys.limits else rigid.limits,
            max_rate=rigid.max_rate if keys.max_rate is None else keys.max_rate,
            max_acceleration=keys.max_acceleration,
            torque_table=tuple((a, t) for a, t in keys.torque_table or []) or None,
        )
        if elastic.torque_table:
            akima(*np.array(elastic.torque_table).T)  # refuses a curve that falls in between
        backlash, elements = keys.hysteresis()
        return replace(
            elastic,
            backlash=backlash,
            hysteresis=elements,
            kinematic_error=keys.kinematic_errors(),
            balancer=_balancer(elastic, keys, base_from_file, base_from_previous),
            drive=keys.motor(),
        )


def _balancer(
    joint: Joint, keys: JointElasticity, base_from_file: np.ndarray, base_from_previous: np.ndarray
) -> Table | None:
    """Return the points of a joint's balancer [rad, N m]; arguments as of `_elastic`."""
    if keys.balancer is None:
        return None
    if keys.balancer.torque_table is not None:
        return tuple((angle, torque) for angle, torque in keys.balancer.torque_table)
    spring = keys.balancer.gas_spring
    assert spring is not None
    if joint.limits is None:
        raise ValueError("balancer: gas_spring: expected limits of the joint beside it, got none")
    geometry = BalancerGeometry(
        np.array(joint.origin),
        np.array(joint.axis),
        base_from_previous @ spring.base_point,
        base_from_file @ spring.link_point,
    )
    with locate_errors("balancer", ValueError):
        return gas_spring_points(spring, geometry, joint.limits)


def _payload(table: BodyTable | None, last_from_file: pin.SE3, path: Path) -> Body | None:
    if table is None:
        return None
    with locate_errors(f"{path}: payload", ValueError, RobotFileError):
        return table.body().placed(last_from_file.rotation, last_from_file.translation)
