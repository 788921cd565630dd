"""MJCF -> URDF: bodies, hinges, slides and inertias as MuJoCo compiles them, and no more."""

from __future__ import annotations

from pathlib import Path
from typing import Any
from xml.etree.ElementTree import Element, SubElement, indent, tostring

import numpy as np
import pinocchio as pin

from coupling.files.extras import extra
from elastic_robot.errors import RobotFileError

# Gravity of a robot file that states none, and how far it differs from place to place [m/s^2].
_GRAVITY, _USUAL_SPREAD = 9.81, 0.05


def read_mjcf(file: Path) -> tuple[str, tuple[str, ...]]:
    """Return the URDF text of an MJCF file's bodies, joints and sites, and what it has no word for.

    Angles count from the pose as it is written, where all joints are at their `ref`.  A free joint is
    written as floating.

    Raises:
        RobotFileError: If MuJoCo is not installed or cannot read the file, or has joints that a URDF
            has no word for.

    Returns:
        The text, and sentences on what the file says of its robot's dynamics beside.
    """
    mujoco = extra("mujoco", "mjcf", "an MJCF file")
    try:
        model = mujoco.MjModel.from_xml_path(str(file))
    except (ValueError, OSError) as cause:
        said = str(cause).strip().splitlines()
        raise RobotFileError(
            f"{file}: cannot be read as MJCF: {said[0] if said else cause}"
        ) from cause
    x, y, z = model.opt.gravity.tolist()
    if max(abs(x), abs(y), z) > 1e-6:
        raise RobotFileError(
            f"{file}: option: gravity: expected it along -z, got {_text(model.opt.gravity)}: turn the"
            " model so that its z axis points up"
        )
    root = Element("robot", name=file.stem)
    SubElement(root, "link", name="world")
    for body in range(1, model.nbody):
        _write_body(root, model, body, file)
    for site in range(model.nsite):
        name = model.site(site).name
        if name:
            link = _body_name(model, int(model.site_bodyid[site]))
            placement = _placement(model.site_pos[site], model.site_quat[site])
            _write_joint(root, f"{name}_site", "fixed", link, f"site_{name}", placement)
    for joint, other in _coupled_joints(model, mujoco).items():
        element = next(e for e in root.findall("joint") if e.get("name") == _name(model, joint))
        SubElement(element, "mimic", joint=_name(model, other))
    indent(root)
    return tostring(root, encoding="unicode"), _unread_dynamics(model)


def _unread_dynamics(model: Any) -> tuple[str, ...]:
    """Return sentences on what a model says of its robot's dynamics and no URDF has a word for."""
    sentences = []
    for word, values, unit, remedy in (
        (
            "armature",
            model.dof_armature,
            "kg m^2",
            "it is the rotor's inertia at the output, rotor_inertia_kg_m2 times gear_ratio^2 of"
            " [joint.drive]",
        ),
        ("damping", model.dof_damping, "N m s/rad", "it is viscous_Nm_s of [joint.drive.friction]"),
        (
            "frictionloss",
            model.dof_frictionloss,
            "N m",
            "it is coulomb_Nm of [joint.drive.friction]",
        ),
        (
            "stiffness",
            model.jnt_stiffness,
            "N m/rad",
            "write a spring's torque as [joint.balancer]",
        ),
        ("gravcomp", model.body_gravcomp, "of the weight", "the bodies weigh here what they weigh"),
    ):
        nonzero = values[values != 0.0]
        if nonzero.size:
            low, high = f"{nonzero.min():.4g}", f"{nonzero.max():.4g}"
            span = low if low == high else f"{low} to {high}"
            sentences.append(f"Left out of the MJCF: {word}, {span} {unit}: {remedy}.")
    if abs(pull := -float(model.opt.gravity[2]) - _GRAVITY) > _USUAL_SPREAD:
        sentences.append(
            f"Left out of the MJCF: gravity, {_GRAVITY + pull:.4g} m/s^2: here it is {_GRAVITY:g}, where"
            " the robot file has no other one."
        )
    return tuple(sentences)


def _coupled_joints(model: Any, mujoco: Any) -> dict[int, int]:
    """Return the joints that constraints move, each with one that it moves with.

    A joint may follow another one; a connection or a weld of two bodies closes a loop, none of whose
    joints moves alone.
    """
    kinds, coupled = mujoco.mjtEq, dict[int, int]()
    for number in np.flatnonzero(model.eq_active0).tolist():
        ends = [int(model.eq_obj1id[number]), int(model.eq_obj2id[number])]
        kind = kinds(int(model.eq_type[number]))
        if kind == kinds.mjEQ_JOINT:
            coupled[ends[0]] = ends[1] if ends[1] >= 0 else ends[0]
            continue
        if kind == kinds.mjEQ_TENDON:
            joints = [joint for tendon in ends if tendon >= 0 for joint in _wrapped(model, tendon)]
        elif kind in (kinds.mjEQ_CONNECT, kinds.mjEQ_WELD):
            if mujoco.mjtObj(int(model.eq_objtype[number])) == mujoco.mjtObj.mjOBJ_SITE:
                ends = [int(model.site_bodyid[site]) for site in ends]
            if any(model.body_mocapid[body] >= 0 for body in ends):
                continue  # a handle of the simulation
            first, second = (_joints_before(model, body) for body in ends)
            joints = [*(first - second), *(second - first)]
        else:
            continue
        for joint in joints:
            coupled[joint] = next((other for other in joints if other != joint), joint)
    return coupled


def _wrapped(model: Any, tendon: int) -> list[int]:
    """Return the joints that a tendon couples."""
    begin = int(model.tendon_adr[tendon])
    return [int(joint) for joint in model.wrap_objid[begin : begin + int(model.tendon_num[tendon])]]


def _joints_before(model: Any, body: int) -> set[int]:
    """Return the joints between the world and a body."""
    joints = set[int]()
    while body > 0:
        first = int(model.body_jntadr[body])
        joints.update(range(first, first + int(model.body_jntnum[body])) if first >= 0 else ())
        body = int(model.body_parentid[body])
    return joints


def _name(model: Any, joint: int) -> str:
    return model.joint(joint).name or f"joint{joint}"


def _body_name(model: Any, body: int) -> str:
    return model.body(body).name or (f"body{body}" if body else "world")


def _write_body(root: Element, model: Any, body: int, file: Path) -> None:
    """Write a body behind its joints, as a link in the body's frame."""
    parent, name = _body_name(model, int(model.body_parentid[body])), _body_name(model, body)
    placement = _placement(model.body_pos[body], model.body_quat[body])
    first, count = int(model.body_jntadr[body]), int(model.body_jntnum[body])
    # A link's frame lies on its joint; a body's need not, and then is a link of its own.
    is_apart = count > 0 and bool(np.any(model.jnt_pos[first + count - 1]))
    for number in range(first, first + count):
        at = pin.SE3(np.eye(3), np.array(model.jnt_pos[number]))
        is_last = number == first + count - 1 and not is_apart
        link = name if is_last else f"{name}_{number - first + 1}"
        joint = model.joint(number)
        kind = {0: "floating", 2: "prismatic", 3: "revolute"}.get(int(model.jnt_type[number]))
        if kind is None:
            raise RobotFileError(
                f"{file}: joint {joint.name!r}: expected a hinge, a slide or a free joint, got a ball"
            )
        element = _write_joint(root, _name(model, number), kind, parent, link, placement * at)
        if kind != "floating":
            _write_range(element, model, number, kind)
        placement, parent = at.inverse(), link
    if count == 0 or is_apart:
        _write_joint(root, f"{name}_fixed", "fixed", parent, name, placement)
    _write_inertia(root, model, body, name)


def _write_joint(
    root: Element, name: str, kind: str, parent: str, child: str, placement: pin.SE3
) -> Element:
    joint = SubElement(root, "joint", name=name, type=kind)
    SubElement(joint, "parent", link=parent)
    SubElement(joint, "child", link=child)
    _write_origin(joint, placement)
    SubElement(root, "link", name=child)
    return joint


def _write_range(element: Element, model: Any, number: int, kind: str) -> None:
    """Write a joint's axis, and its range from where it is written on."""
    SubElement(element, "axis", xyz=_text(model.jnt_axis[number]))
    torque = model.jnt_actfrcrange[number] if model.jnt_actfrclimited[number] else (0.0, 0.0)
    effort = f"{float(min(abs(torque[0]), abs(torque[1]))):.12g}"
    if model.jnt_limited[number]:
        low, high = model.jnt_range[number] - model.qpos0[model.jnt_qposadr[number]]
        limits = {"lower": f"{low:.12g}", "upper": f"{high:.12g}"}
        SubElement(element, "limit", {**limits, "effort": effort, "velocity": "0"})
    else:
        SubElement(element, "limit", effort=effort, velocity="0")
        if kind == "revolute":
            element.set("type", "continuous")


def _write_inertia(root: Element, model: Any, body: int, name: str) -> None:
    if model.body_mass[body] == 0.0:
        return
    link = next(candidate for candidate in root.findall("link") if candidate.get("name") == name)
    inertial = SubElement(link, "inertial")
    _write_origin(inertial, _placement(model.body_ipos[body], model.body_iquat[body]))
    SubElement(inertial, "mass", value=f"{float(model.body_mass[body]):.17g}")
    principal = zip(("ixx", "iyy", "izz"), model.body_inertia[body], strict=True)
    moments = {key: f"{float(value):.17g}" for key, value in principal}
    SubElement(inertial, "inertia", {**moments, "ixy": "0", "ixz": "0", "iyz": "0"})


def _write_origin(element: Element, placement: pin.SE3) -> None:
    rpy = pin.rpy.matrixToRpy(placement.rotation)
    SubElement(element, "origin", xyz=_text(placement.translation), rpy=_text(rpy))


def _placement(position: np.ndarray, quaternion: np.ndarray) -> pin.SE3:
    """Return a placement; MuJoCo writes the real part of a quaternion first."""
    w, x, y, z = quaternion / np.linalg.norm(quaternion)
    return pin.SE3(pin.Quaternion(w, x, y, z).matrix(), np.array(position))


def _text(values: np.ndarray) -> str:
    return " ".join(f"{float(value):.17g}" for value in values)
