"""The rigid bodies and hinges of a robot as MJCF, and MuJoCo's matrices of them.

Every rotation of the chain is a hinge; MuJoCo applies several hinges of one body in their order, as
the model does.
"""

from __future__ import annotations

from xml.etree.ElementTree import Element, SubElement, tostring

import mujoco
import numpy as np
import pinocchio as pin

from elastic_robot.body import Body
from elastic_robot.description import Robot

TCP = "tcp"


def joint_name(joint: int) -> str:
    """Return the name of a joint's own hinge, joints counted from 0."""
    return f"joint{joint + 1}"


def tilt_name(joint: int, tilt: int) -> str:
    """Return the name of a tilt's hinge, joint and tilt counted from 0."""
    return f"joint{joint + 1}_tilt{tilt + 1}"


def numbers(values: np.ndarray | tuple[float, ...] | list[float]) -> str:
    """Return numbers as an attribute of MJCF, without loss."""
    return " ".join(f"{float(value):.17g}" for value in values)


def mjcf(robot: Robot) -> Element:
    """Return bodies, hinges, gravity and the TCP of a robot; no springs, dampers or drives."""
    root = Element("mujoco", model=robot.name)
    SubElement(root, "compiler", angle="radian")
    SubElement(root, "option", gravity=numbers(robot.gravity))
    parent = SubElement(root, "worldbody")
    last = len(robot.joints) - 1
    for i, joint in enumerate(robot.joints):
        parent = SubElement(parent, "body", name=f"body{i + 1}", pos=numbers(joint.origin))
        body = _merged(joint.body, robot.payload if i == last else None)
        SubElement(
            parent,
            "inertial",
            pos=numbers(body.com),
            mass=numbers([body.mass]),
            fullinertia=numbers(body.inertia_matrix[[0, 1, 2, 0, 0, 1], [0, 1, 2, 1, 2, 2]]),
        )
        SubElement(parent, "joint", name=joint_name(i), axis=numbers(joint.axis))
        for k, tilt in enumerate(joint.tilt):
            SubElement(parent, "joint", name=tilt_name(i, k), axis=numbers(tilt.axis))
    quaternion = pin.Quaternion(pin.rpy.rpyToMatrix(*robot.tcp_rpy)).coeffs()  # x y z w
    wxyz = numbers(np.roll(quaternion, 1))
    SubElement(parent, "site", name=TCP, pos=numbers(robot.tcp_position), quat=wxyz)
    return root


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


def compiled(root: Element) -> mujoco.MjModel:
    """Return the model that an MJCF describes."""
    return mujoco.MjModel.from_xml_string(tostring(root, encoding="unicode"))


def tcp_pose(data: mujoco.MjData) -> np.ndarray:
    """Return x, y, z, qx, qy, qz, qw of the TCP in the base frame, qw >= 0, (7,)."""
    wxyz = np.empty(4)
    mujoco.mju_mat2Quat(wxyz, data.site(TCP).xmat)
    if wxyz[0] < 0.0:
        wxyz *= -1.0
    return np.concatenate([data.site(TCP).xpos, wxyz[1:], wxyz[:1]])


class MujocoRobot:
    """Mass matrix, bias forces, TCP and Jacobian of a robot's chain, from MuJoCo.

    Example:
        >>> from elastic_robot.coupling.files.robot_file import find_robot, load_robot
        >>> robot = MujocoRobot(load_robot(find_robot("icme2008")))
        >>> robot.set(np.zeros(12), np.zeros(12))
        >>> robot.tcp()[0].round(9).tolist()
        [1.95, 0.0, 2.05]
    """

    def __init__(self, robot: Robot) -> None:
        self.model = compiled(mjcf(robot))
        self.data = mujoco.MjData(self.model)

    def set(self, theta: np.ndarray, rate: np.ndarray) -> None:
        """Take the angles [rad] and rates [rad/s] of all hinges, base to tool, (angles,)."""
        self.data.qpos[:] = theta
        self.data.qvel[:] = rate
        mujoco.mj_forward(self.model, self.data)

    def mass_matrix(self) -> np.ndarray:
        """Return M [kg m^2], (angles, angles)."""
        n = self.model.nv
        full = np.zeros((n, n))
        for k in range(n):  # column by column: independent of the storage of the sparse matrix
            unit = np.zeros(n)
            unit[k] = 1.0
            mujoco.mj_mulM(self.model, self.data, full[k], unit)
        return full

    def bias(self) -> np.ndarray:
        """Return the Coriolis, centrifugal and gravity torques h [N m], (angles,)."""
        return self.data.qfrc_bias.copy()

    def tcp(self) -> tuple[np.ndarray, np.ndarray]:
        """Return position [m], (3,), and rotation matrix, (3, 3), of base_from_tool."""
        site = self.data.site(TCP)
        return site.xpos.copy(), site.xmat.reshape(3, 3).copy()

    def jacobian(self) -> np.ndarray:
        """Return d(TCP velocity, angular velocity)/d(rate), base axes, (6, angles)."""
        both = np.zeros((6, self.model.nv))
        mujoco.mj_jacSite(self.model, self.data, both[:3], both[3:], self.model.site(TCP).id)
        return both
