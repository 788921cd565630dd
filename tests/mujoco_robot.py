"""A second implementation of the robot: MuJoCo, from the same description.

Every rotation of the chain is a hinge; MuJoCo applies several hinges of one body in their order, as
the model does.  Springs, dampers and drives are not part of the MuJoCo model.
"""

from __future__ import annotations

from xml.etree.ElementTree import Element, SubElement, tostring

import mujoco
import numpy as np
import pinocchio as pin

from elastic_robot.description import Body, Robot


def _text(values) -> str:
    return " ".join(f"{float(value):.17g}" for value in values)


def _merged(first: Body, second: Body | None) -> Body:
    """Return one body for a link and its payload."""
    if second is None:
        return first
    mass = first.mass + second.mass
    com = (first.mass * np.array(first.com) + second.mass * np.array(second.com)) / mass
    inertia = np.zeros((3, 3))
    for body in (first, second):
        arm = np.array(body.com) - com
        inertia += body.inertia_matrix + body.mass * (arm @ arm * np.eye(3) - np.outer(arm, arm))
    six = inertia[[0, 1, 2, 0, 0, 1], [0, 1, 2, 1, 2, 2]]
    return Body(mass, tuple(com.tolist()), tuple(six.tolist()))


def mjcf(robot: Robot) -> str:
    """Return the robot as MJCF."""
    root = Element("mujoco", model=robot.name)
    SubElement(root, "compiler", angle="radian")
    SubElement(root, "option", gravity=_text(robot.gravity))
    parent = SubElement(root, "worldbody")
    for number, joint in enumerate(robot.joints, start=1):
        parent = SubElement(parent, "body", name=f"body{number}", pos=_text(joint.origin))
        last = number == len(robot.joints)
        body = _merged(joint.body, robot.payload if last else None)
        matrix = body.inertia_matrix
        SubElement(
            parent,
            "inertial",
            pos=_text(body.com),
            mass=_text([body.mass]),
            fullinertia=_text(matrix[[0, 1, 2, 0, 0, 1], [0, 1, 2, 1, 2, 2]]),
        )
        SubElement(parent, "joint", name=f"joint{number}", axis=_text(joint.axis))
        for order, tilt in enumerate(joint.tilt, start=1):
            SubElement(parent, "joint", name=f"tilt{number}_{order}", axis=_text(tilt.axis))
    quaternion = pin.Quaternion(pin.rpy.rpyToMatrix(*robot.tcp_rpy)).coeffs()  # x y z w
    SubElement(
        parent,
        "site",
        name="tcp",
        pos=_text(robot.tcp_position),
        quat=_text(np.roll(quaternion, 1)),
    )
    return tostring(root, encoding="unicode")


class MujocoRobot:
    """Mass matrix, bias forces, TCP and Jacobian of the chain, from MuJoCo."""

    def __init__(self, robot: Robot) -> None:
        self.model = mujoco.MjModel.from_xml_string(mjcf(robot))
        self.data = mujoco.MjData(self.model)

    def set(self, theta: np.ndarray, rate: np.ndarray) -> None:
        self.data.qpos[:] = theta
        self.data.qvel[:] = rate
        mujoco.mj_forward(self.model, self.data)

    def mass_matrix(self) -> np.ndarray:
        n = self.model.nv
        full = np.zeros((n, n))
        for k in range(n):  # column by column: independent of the storage of the sparse matrix
            unit = np.zeros(n)
            unit[k] = 1.0
            mujoco.mj_mulM(self.model, self.data, full[k], unit)
        return full

    def bias(self) -> np.ndarray:
        return self.data.qfrc_bias.copy()

    def tcp(self) -> tuple[np.ndarray, np.ndarray]:
        return self.data.site_xpos[0].copy(), self.data.site_xmat[0].reshape(3, 3).copy()

    def jacobian(self) -> np.ndarray:
        both = np.zeros((6, self.model.nv))
        mujoco.mj_jacSite(self.model, self.data, both[:3], both[3:], 0)
        return both
