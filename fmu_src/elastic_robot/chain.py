"""Robot -> Pinocchio chain of drive, elastic and tilt rotations, with the index sets between them."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np
import pinocchio as pin

from elastic_robot.balancers import Balancers
from elastic_robot.body import Body
from elastic_robot.description import Robot
from elastic_robot.errors import ElasticRobotError
from elastic_robot.hysteresis import Elements
from elastic_robot.kinematic_errors import KinematicErrors

# Smallest eigenvalue of the elastic mass matrix relative to its largest diagonal entry.  Below it
# an elastic coordinate moves no inertia of its own and its equation of motion cannot be solved.
_MASS_RATIO = 1e-12


@dataclass(frozen=True)
class Chain:
    """Pinocchio model of a robot.

    theta has one angle per rotation of the chain; the drives q and the elastic coordinates x share
    it: theta[drive] = q, then theta[elastic] += x.  Behind gears with kinematic errors it is the angle
    at their outputs that takes the place of q.

    Attributes:
        model: Pinocchio model, one revolute joint per angle.
        tcp: Frame number of the TCP in `model`.
        axes: Direction of each rotation's axis, (angles, 3).
        drive: Index in theta of each joint's own rotation, (n,).
        elastic: Index in theta of each elastic coordinate, (m,).
        elastic_joint: Number of the joint (from 0) that owns each elastic coordinate, (m,).
        elastic_tilt: Number of its tilt, 1 or 2, or 0 for the torsion about the joint's axis, (m,).
        elements: Elements of the gears' hysteresis.
        kinematic_errors: Kinematic errors of the gears.
        balancers: Balancers of the joints.
    """

    model: pin.Model
    tcp: int
    axes: np.ndarray
    drive: np.ndarray
    elastic: np.ndarray
    elastic_joint: np.ndarray
    elastic_tilt: np.ndarray
    elements: Elements
    kinematic_errors: KinematicErrors
    balancers: Balancers

    @cached_property
    def selection(self) -> np.ndarray:
        """Selection matrix S^T with theta = S x + drives, (m, angles)."""
        selection = np.zeros((self.elastic_count, self.model.nv))
        selection[np.arange(self.elastic_count), self.elastic] = 1.0
        return selection

    @cached_property
    def drive_selection(self) -> np.ndarray:
        """Selection matrix of the drives, likewise, (n, angles)."""
        selection = np.zeros((self.joint_count, self.model.nv))
        selection[np.arange(self.joint_count), self.drive] = 1.0
        return selection

    @cached_property
    def elastic_names(self) -> tuple[str, ...]:
        """joint[i] or joint[i].tilt[k] for every elastic coordinate, in the order of x."""
        pairs = zip(self.elastic_joint + 1, self.elastic_tilt, strict=True)
        return tuple(f"joint[{i}].tilt[{k}]" if k else f"joint[{i}]" for i, k in pairs)

    @cached_property
    def torsions(self) -> np.ndarray:
        """Mask of the elastic coordinates that may have backlash, all but the tilts, (m,)."""
        return np.flatnonzero(self.elastic_tilt == 0)

    @property
    def joint_count(self) -> int:
        """Number of driven joints n."""
        return len(self.drive)

    @property
    def elastic_count(self) -> int:
        """Number of elastic coordinates m."""
        return len(self.elastic)

    def theta(self, q: np.ndarray, x: np.ndarray | None = None) -> np.ndarray:
        """Return all angles of the chain [rad].

        Args:
            q: Drive angles [rad], (n,) or (samples, n).
            x: Elastic coordinates [rad], (m,) or (samples, m); None for the rigid robot.
        """
        theta: np.ndarray = q @ self.drive_selection
        return theta if x is None else theta + x @ self.selection


def build_chain(robot: Robot) -> Chain:
    """Build the chain of a robot.

    Raises:
        ElasticRobotError: If an elastic coordinate moves no inertia of its own (a massless tip, or
            a tilt parallel to the joint's axis).
    """
    model = pin.Model()
    model.name = robot.name
    model.gravity.linear = np.array(robot.gravity)
    parent = 0
    axes, drive, elastic, elastic_joint, elastic_tilt = [], [], [], [], []

    def add_rotation(axis: tuple[float, ...], placement: pin.SE3, name: str) -> int:
        nonlocal parent
        axes.append(axis)
        parent = model.addJoint(
            parent, pin.JointModelRevoluteUnaligned(np.array(axis)), placement, name
        )
        return model.joints[parent].idx_v

    for number, joint in enumerate(robot.joints):
        placement = pin.SE3(np.eye(3), np.array(joint.origin))
        index = add_rotation(joint.axis, placement, f"joint{number + 1}")
        drive.append(index)
        if joint.stiffness is not None:
            elastic.append(index)
            elastic_joint.append(number)
            elastic_tilt.append(0)
        for order, tilt in enumerate(joint.tilt, start=1):
            name = f"joint{number + 1}_tilt{order}"
            elastic.append(add_rotation(tilt.axis, pin.SE3.Identity(), name))
            elastic_joint.append(number)
            elastic_tilt.append(order)
        _append_body(model, parent, joint.body)
    if robot.payload is not None:
        _append_body(model, parent, robot.payload)
    body_from_tool = pin.SE3(pin.rpy.rpyToMatrix(*robot.tcp_rpy), np.array(robot.tcp_position))
    tcp = model.addFrame(pin.Frame("tcp", parent, 0, body_from_tool, pin.FrameType.OP_FRAME))
    chain = Chain(
        model=model,
        tcp=tcp,
        axes=np.array(axes),
        drive=np.array(drive, dtype=int),
        elastic=np.array(elastic, dtype=int),
        elastic_joint=np.array(elastic_joint, dtype=int),
        elastic_tilt=np.array(elastic_tilt, dtype=int),
        elements=Elements.of(robot),
        kinematic_errors=KinematicErrors.of(robot),
        balancers=Balancers.of(robot, np.array(drive, dtype=int)),
    )
    _require_inertia(chain, robot)
    return chain


def spatial_inertia(mass: float, com: np.ndarray, moments: np.ndarray) -> pin.Inertia:
    """Return a body's inertia as Pinocchio has it, whatever its moments.

    Pinocchio's own constructor refuses moments that are below zero by rounding.

    Args:
        mass: Mass [kg], >= 0.
        com: Centre of mass [m], (3,).
        moments: Inertia about it [kg m^2], (3, 3).
    """
    inertia = pin.Inertia(mass, com, np.eye(3))
    inertia.inertia = moments
    return inertia


def _append_body(model: pin.Model, joint: int, body: Body) -> None:
    inertia = spatial_inertia(body.mass, np.array(body.com), body.inertia_matrix)
    model.appendBodyToJoint(joint, inertia, pin.SE3.Identity())


def _require_inertia(chain: Chain, robot: Robot) -> None:
    if chain.elastic_count == 0:
        return
    mass = pin.crba(chain.model, chain.model.createData(), np.zeros(chain.model.nv))
    mass = mass[np.ix_(chain.elastic, chain.elastic)]
    values, vectors = np.linalg.eigh(mass)
    if values[0] <= _MASS_RATIO * mass.diagonal().max():
        worst = int(np.argmax(np.abs(vectors[:, 0])))
        number, tilt = chain.elastic_joint[worst], chain.elastic_tilt[worst]
        name = robot.joints[number].name
        joint = f"joint {number + 1}" + (f" ({name!r})" if name else "")
        part = f"tilt {tilt} of {joint}" if tilt else f"the elastic {joint}"
        raise ElasticRobotError(
            f"{part}: expected an inertia of its own to move, got none: give mass and inertia behind"
            " it, and tilt axes that differ from the joint's axis and from each other"
        )
