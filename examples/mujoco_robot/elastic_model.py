"""The elastic robot in MuJoCo's terms: springs, dampers, backlash, prescribed drives, wrench.

A hinge carries the stiffness k and the damping d of its joint or tilt.  Actuators do the rest, in
MuJoCo's C code but for the smooth curve:

drive
    k (q + d/k q') on the hinge of an elastic joint moves the rest of its spring and damper to the
    drive; all together are -k x - d x' with x = theta - q.
rotor
    On the hinge of a rigid joint: q'' times a rotor inertia that no load can hold up.
relief
    What the gear does not carry of k x: k x clipped at +-k B for the sharp backlash.
wrench
    Unit force or moment at the TCP, base axes.
"""

from __future__ import annotations

from collections.abc import Sequence
from contextlib import AbstractContextManager, nullcontext
from xml.etree.ElementTree import Element, SubElement

import mujoco
import numpy as np

from elastic_robot.description import Robot
from examples.mujoco_robot.integrators import DriveSamples, Integrator
from examples.mujoco_robot.multibody import TCP, compiled, joint_name, mjcf, numbers, tilt_name
from examples.mujoco_robot.smooth_backlash import smooth_backlash

# Rotor inertia of a rigid joint [kg m^2]: a load of 1e6 N m turns it by 1e-11 rad in a minute.
_ROTOR = 1e20
# Parts of MuJoCo's step that this robot has no use for.
_SKIPPED = ("constraint", "contact", "clampctrl", "warmstart", "autoreset", "eulerdamp")


class ElasticModel:
    """A robot with its elasticities as a MuJoCo model.

    Args:
        robot: Its description.
        torque_curve: "linear", "backlash", or "spline" for the backlash with rounded corners.
        integrator: Decides how the actuators are controlled.
        step: Time step [s].
        wrench_axes: Which of fx, fy, fz, mx, my, mz (0 to 5) may act; each costs time.

    Attributes:
        model, data: MuJoCo's.
        hinge: Angle number of each joint's own hinge, (joints,).
        elastic: Angle number of each elastic coordinate x, base to tool, (m,).
        gears, rigid: Numbers of the elastic joints, and of the others.

    Raises:
        ValueError: If the torque curve is not known, or a joint has its own table of it.
    """

    def __init__(
        self,
        robot: Robot,
        torque_curve: str,
        integrator: Integrator,
        step: float,
        wrench_axes: Sequence[int] = (),
    ) -> None:
        if torque_curve not in ("linear", "backlash", "spline"):
            raise ValueError(
                f"torque_curve: expected one of linear, backlash, spline, got {torque_curve!r}"
            )
        if torque_curve == "spline" and any(joint.torque_table for joint in robot.joints):
            raise ValueError("a joint has a torque_table; MuJoCo's spline is the default one only")
        joints = robot.joints
        self._integrator = integrator
        self._curve = torque_curve
        self.gears = [i for i, joint in enumerate(joints) if joint.stiffness is not None]
        self.rigid = [i for i, joint in enumerate(joints) if joint.stiffness is None]
        with_backlash = torque_curve != "linear"
        self._loose = [i for i in self.gears if with_backlash and joints[i].backlash > 0.0]
        # Time [s] by which damping shifts the rest of a gear's spring: d/k.
        self._lag = np.array([joints[i].damping / (joints[i].stiffness or 1.0) for i in self.gears])
        self._gear_stiffness = np.array([joints[i].stiffness for i in self._loose])
        self._backlash = np.array([joints[i].backlash for i in self._loose])
        self.wrench_axes = list(wrench_axes)
        self.model = compiled(self._mjcf(robot))
        self.model.opt.integrator = integrator.number
        self.model.opt.timestep = step
        self.data = mujoco.MjData(self.model)
        self.hinge = np.array(
            [self.model.joint(joint_name(i)).qposadr[0] for i in range(len(joints))]
        )
        self.elastic = np.setdiff1d(np.arange(self.model.nq), self.hinge[self.rigid])

    def undeflected(self, q: np.ndarray) -> np.ndarray:
        """Return the angles of all hinges of the rigid robot at drive angles q, (..., angles)."""
        angles = np.zeros((*np.shape(q)[:-1], self.model.nq))
        angles[..., self.hinge] = q
        return angles

    def signals(self, samples: DriveSamples) -> np.ndarray:
        """Return what the drive, rotor and relief actuators follow, (steps + 1, actuators)."""
        rest = self._integrator.angle(samples.of_joints(self.gears), self._lag)
        rotor = self._integrator.acceleration(samples.of_joints(self.rigid))
        relief = self._integrator.angle(samples.of_joints(self._loose), np.zeros(len(self._loose)))
        return np.hstack([rest, rotor, relief])

    def hold(self, q: np.ndarray) -> None:
        """Set the actuators to drives that stand still at q, (joints,)."""
        signal = np.concatenate([q[self.gears], np.zeros(len(self.rigid)), q[self._loose]])
        self._integrator.present(self.data)[: len(signal)] = signal

    def running(self) -> AbstractContextManager[None]:
        """Return the context in which MuJoCo may evaluate this model: it knows the smooth curve."""
        if self._curve != "spline":
            return nullcontext()
        first = len(self.gears) + len(self.rigid)
        drive = self._integrator.present(self.data)[first:]
        angle = self.data.actuator_length[first:]
        return smooth_backlash(first, angle, drive, self._gear_stiffness, self._backlash)

    def _mjcf(self, robot: Robot) -> Element:
        root = mjcf(robot)
        option, world = root.find("option"), root.find("worldbody")
        assert option is not None
        assert world is not None
        SubElement(option, "flag", dict.fromkeys(_SKIPPED, "disable"))
        SubElement(world, "site", name="base")
        hinges = {hinge.get("name"): hinge for hinge in root.iter("joint")}
        actuators = SubElement(root, "actuator")

        def follow(joint: int, gain: float) -> Element:
            return SubElement(
                actuators,
                "general",
                joint=joint_name(joint),
                dyntype=self._integrator.dyntype,
                gainprm=numbers([gain]),
            )

        def spring(hinge: str, stiffness: float, damping: float) -> None:
            hinges[hinge].set("stiffness", numbers([stiffness]))
            hinges[hinge].set("damping", numbers([damping]))

        for i, joint in enumerate(robot.joints):
            for k, tilt in enumerate(joint.tilt):
                spring(tilt_name(i, k), tilt.stiffness, tilt.damping)
        for i in self.gears:
            stiffness = robot.joints[i].stiffness or 0.0
            spring(joint_name(i), stiffness, robot.joints[i].damping)
            follow(i, stiffness)
        for i in self.rigid:
            hinges[joint_name(i)].set("armature", numbers([_ROTOR]))
            follow(i, _ROTOR)
        for i, stiffness, backlash in zip(
            self._loose, self._gear_stiffness, self._backlash, strict=True
        ):
            if self._curve == "spline":
                follow(i, 0.0).set("biastype", "user")
                continue
            relief = follow(i, -stiffness)
            relief.set("biastype", "affine")
            relief.set("biasprm", numbers([0.0, stiffness, 0.0]))
            relief.set("forcelimited", "true")
            relief.set("forcerange", numbers([-stiffness * backlash, stiffness * backlash]))
        for axis in self.wrench_axes:
            gear = numbers(np.eye(6)[axis])
            SubElement(actuators, "general", site=TCP, refsite="base", gear=gear)
        return root
