"""A robot with motors as MuJoCo sees it: a motor's hinge with the rotor as armature, behind it a gear's.

Both turn about the joint's axis; spring, damper and backlash stand on the gear's hinge, viscous
friction on the motor's. Elongations and the servo's integral are states of MuJoCo's actuators, and
the servo is an actuator whose control a callback writes in every stage of its Runge-Kutta method.
Nothing of the project's dynamics is used.
"""

from collections.abc import Callable
from functools import lru_cache
from xml.etree.ElementTree import Element, SubElement

import mujoco
import numpy as np

from elastic_robot.description import Joint, Robot
from elastic_robot.drive import Drive
from examples.mujoco_robot.multibody import compiled, joint_name, mjcf, numbers, tcp_pose, tilt_name

# Armature of a rigid joint [kg m^2]: what stands still stays there.
_ROTOR = 1e20
_SKIPPED = ("constraint", "contact", "clampctrl", "warmstart", "autoreset", "eulerdamp")
# q_cmd and q_cmd' of all joints over time.
Command = Callable[[float], tuple[np.ndarray, np.ndarray]]


def motor_name(joint: int) -> str:
    """Return the name of a motor's hinge, joints counted from 0."""
    return f"motor{joint + 1}"


class DrivenMujoco:
    """One simulation by MuJoCo's RK4 in equal steps.

    Args:
        robot: Every elastic joint has a drive; rigid joints stand still.
        command: Of the drives.
        backlash: Whether gears have theirs; else they are linear.
        step: [s].

    Attributes:
        motors: Joints with a motor, counted from 0.
        torque: That motors without servo exert [N m], one for each; None: they have their servo.
    """

    def __init__(self, robot: Robot, command: Command, backlash: bool, step: float) -> None:
        self.robot, self.backlash = robot, backlash
        self.command = lru_cache(maxsize=1)(command)  # two stages of a step are at one time
        self.torque: np.ndarray | None = None
        self.motors = [i for i, joint in enumerate(robot.joints) if joint.drive is not None]
        self.drives: list[Drive] = [robot.joints[i].drive for i in self.motors]
        self.model = compiled(self._mjcf())
        self.model.opt.integrator, self.model.opt.timestep = mujoco.mjtIntegrator.mjINT_RK4, step
        self.data = mujoco.MjData(self.model)
        tcp = self.model.site("tcp")
        self.tcp, self.tool = tcp.id, tcp.bodyid[0]
        hinges = [self.model.joint(motor_name(i)).qposadr[0] for i in self.motors]
        rigid = [i for i, j in enumerate(robot.joints) if j.stiffness is None]
        locked = [self.model.joint(joint_name(i)).qposadr[0] for i in rigid]
        self.motor = np.array(hinges, dtype=int)
        self.rigid = rigid, locked
        self.elastic = np.setdiff1d(np.arange(self.model.nq), [*hinges, *locked])
        count = len(self.motors)
        stops = self.model.nu - 3 * count
        # In the order of the actuators: rate loops, integrals, friction, elements of gears.
        self.limit_of = np.array(
            [d.slip_angle for d in self.drives]
            + [e.slip_angle for i in self.motors for e in robot.joints[i].hysteresis]
        )
        gears = [hinge + 1 for hinge in hinges]
        self.gears = np.array(gears, dtype=int)
        of = [
            g for g, i in zip(gears, self.motors, strict=True) for _ in robot.joints[i].hysteresis
        ]
        self.stop_hinge = np.array([*hinges, *of], dtype=int)
        self.stops = slice(count, 2 * count + stops)  # among the actuators' states
        for key in (
            "position_gain",
            "rate_gain",
            "integral_gain",
            "feed_forward",
            "friction",
            "slip_angle",
            "stribeck",
            "stribeck_rate",
        ):
            setattr(self, f"_{key}", np.array([getattr(d, key) for d in self.drives]))
        self._limit = np.array([d.torque_limit or np.inf for d in self.drives])

    def _mjcf(self) -> Element:
        root = mjcf(self.robot)
        option = root.find("option")
        SubElement(option, "flag", dict.fromkeys(_SKIPPED, "disable"))
        hinges = {hinge.get("name"): hinge for hinge in root.iter("joint")}
        bodies = {body.get("name"): body for body in root.iter("body")}
        for i, joint in enumerate(self.robot.joints):
            for k, tilt in enumerate(joint.tilt):
                hinges[tilt_name(i, k)].set("stiffness", numbers([tilt.stiffness]))
                hinges[tilt_name(i, k)].set("damping", numbers([tilt.damping]))
            gear = hinges[joint_name(i)]
            if joint.stiffness is None:
                gear.set("armature", numbers([_ROTOR]))
                continue
            gear.set("stiffness", numbers([joint.stiffness]))
            gear.set("damping", numbers([joint.damping]))
            body = bodies[f"body{i + 1}"]
            motor = Element("joint", name=motor_name(i), axis=numbers(joint.axis))
            motor.set("armature", numbers([joint.drive.inertia]))
            motor.set("damping", numbers([joint.drive.viscous]))
            if joint.drive.torque_limit is not None:
                limit = joint.drive.torque_limit
                motor.set("actuatorfrcrange", numbers([-limit, limit]))
            body.insert(list(body).index(gear), motor)
        self._add_actuators(SubElement(root, "actuator"))
        return root

    def _add_actuators(self, actuators: Element) -> None:
        joints = self.robot.joints

        def add(hinge: str, kind: str, gain: float) -> Element:
            return SubElement(
                actuators, "general", joint=hinge, dyntype=kind, gainprm=numbers([gain])
            )

        for kind, gain in (("none", 1.0), ("integrator", 1.0), ("integrator", 0.0)):
            for i in self.motors:
                add(motor_name(i), kind, gain)
        for i in self.motors:
            for element in joints[i].hysteresis:
                add(joint_name(i), "integrator", -element.stiffness)
        loose = [i for i in self.motors if self.backlash and joints[i].backlash > 0.0]
        for i in loose:
            self._add_relief(add(joint_name(i), "none", 0.0), joints[i])

    def _add_relief(self, relief: Element, joint: Joint) -> None:
        """Let a gear's actuator take k e within the backlash off its spring."""
        most = joint.stiffness * joint.backlash
        relief.set("biastype", "affine")
        relief.set("biasprm", numbers([0.0, joint.stiffness, 0.0]))
        relief.set("forcelimited", "true")
        relief.set("forcerange", numbers([-most, most]))

    def start(
        self, x: np.ndarray, torque: np.ndarray, stops: np.ndarray, wrench: np.ndarray
    ) -> None:
        """Begin at rest: x [rad], torques of motors [N m], elongations of gears' elements [rad]."""
        data, (joints, hinges) = self.data, self.rigid
        q, _ = self.command(0.0)
        data.qpos[self.elastic], data.qpos[self.motor] = x, q[self.motors]
        data.qpos[hinges] = q[joints]
        count = len(self.motors)
        data.act[:count], data.act[2 * count :] = torque, stops
        self.wrench = wrench
        self._act(data)
        mujoco.mj_forward(self.model, data)

    def acceleration(self, motors: bool) -> np.ndarray:
        """Return those of links and tilts [rad/s^2], and of the motors where asked for."""
        total = self.data.qacc.copy()
        total[self.gears] += total[self.motor]
        return np.concatenate([total[self.elastic], self.data.qacc[self.motor] if motors else []])

    def wanted(self, data: mujoco.MjData) -> np.ndarray:
        """Return w of every servo [rad/s]."""
        q, qd = (value[self.motors] for value in self.command(data.time))
        behind = q - data.qpos[self.motor]
        return self._position_gain * behind + self._feed_forward * qd - data.qvel[self.motor]

    def _act(self, data: mujoco.MjData) -> None:
        """Write controls, friction and the wrench of the present state."""
        count, states = len(self.motors), self.stops
        elongation, rate = data.act[states], data.qvel[self.stop_hinge]
        slips = (np.abs(elongation) >= self.limit_of) & (elongation * rate > 0.0)
        if self.torque is None:
            wanted = self.wanted(data)
            unlimited = self._rate_gain * wanted + data.act[:count]
            waits = (np.abs(unlimited) > self._limit) & (unlimited * wanted > 0.0)
            data.ctrl[:count] = self._rate_gain * wanted
            data.ctrl[count : 2 * count] = np.where(waits, 0.0, self._integral_gain * wanted)
        else:
            data.ctrl[:count] = self.torque - data.act[:count]
            data.ctrl[count : 2 * count] = 0.0
        data.ctrl[2 * count : 2 * count + len(slips)] = np.where(slips, 0.0, rate)
        moving = data.qvel[self.motor]
        lost = self._stribeck * (1.0 - np.exp(-((moving / self._stribeck_rate) ** 2)))
        part = np.maximum(-1.0, np.minimum(elongation[:count] / self._slip_angle, 1.0))
        applied, (force, moment) = data.qfrc_applied, self.wrench.reshape(2, 3)
        applied[:] = 0.0
        place = data.site_xpos[self.tcp]
        mujoco.mj_applyFT(self.model, data, force, moment, place, self.tool, applied)
        applied[self.motor] -= self._friction * part * (1.0 - lost)

    def run(self, steps: int) -> None:
        """Go on by so many steps under the present wrench and torques."""
        count = self.stops.start
        states = slice(count, self.stops.stop)
        mujoco.set_mjcb_control(lambda model, data: self._act(data))
        try:
            for _ in range(steps):
                mujoco.mj_step(self.model, self.data)
                # What slipped within the step is at its slip angle.
                held = np.clip(self.data.act[states], -self.limit_of, self.limit_of)
                self.data.act[states] = held
        finally:
            mujoco.set_mjcb_control(None)

    def state(self) -> np.ndarray:
        """Return elastic coordinates, motors' angles [rad], position of the TCP [m], in this order."""
        mujoco.mj_kinematics(self.model, self.data)
        angles = self.data.qpos[self.elastic], self.data.qpos[self.motor]
        return np.concatenate([*angles, tcp_pose(self.data)[:3]])
