"""What an elastic robot shows of its present state."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import pinocchio as pin

from elastic_robot.chain import Chain
from elastic_robot.description import Robot
from elastic_robot.dynamics import Dynamics
from elastic_robot.errors import ParameterError
from elastic_robot.hysteresis import HeldHysteresis, Hysteresis
from elastic_robot.kinematics import base_from_tool, pose_of, rotation_between, tcp_jacobian
from elastic_robot.linearisation import Linearisation, linearise
from elastic_robot.motion import State
from elastic_robot.motors import MotorInstant, Motors
from elastic_robot.parameters import Parameters
from elastic_robot.residual import (
    OperatingPoint,
    ResidualDerivatives,
    free_acceleration,
    residual_derivatives,
)
from elastic_robot.static_sensitivity import StaticSensitivities, static_sensitivities
from elastic_robot.tool_load import ToolLoad
from elastic_robot.torque_curves import TorqueCurve
from elastic_robot.trajectory import Drives
from elastic_robot.turns import Turns


@dataclass(frozen=True)
class HeldInputs:
    """Drives and loads of the robot at the present time.

    Attributes:
        q, qd, qdd: Commanded motion of the drives, before their gears [rad, rad/s, rad/s^2], (n,).
        acting: Loads on the tool.
        torque: Torques of motors without servo [N m], (d,) or of all (1,).
    """

    q: np.ndarray
    qd: np.ndarray
    qdd: np.ndarray
    acting: ToolLoad
    torque: np.ndarray

    @classmethod
    def at(
        cls, time: float, drives: Drives, acting: ToolLoad, torque: np.ndarray | None = None
    ) -> HeldInputs:
        """Return the drives' motion at a time, with what acts on tool and motors then."""
        q, qd, qdd = drives.at(np.array([time]))[:, 0]
        return cls(q, qd, qdd, acting, np.zeros(1) if torque is None else torque)

    @property
    def commands(self) -> np.ndarray:
        """q, q', q'' [rad, rad/s, rad/s^2], (3, n)."""
        return np.stack([self.q, self.qd, self.qdd])


class RobotOutputs:
    """Outputs of a robot by name, as the blocks of the FMU have them; `ElasticRobot` moves it."""

    chain: Chain
    _robot: Robot
    _dynamics: Dynamics
    _curve: TorqueCurve
    _hysteresis: Hysteresis
    _law: Hysteresis
    _motors: Motors
    _parameters: Parameters
    _quasistatic: bool
    _turns: Turns
    _state: State | None
    _inputs: HeldInputs
    _opposite: tuple[bool, bool]

    def tcp(self) -> np.ndarray:
        """Return the pose of the elastic TCP [m, 1], (7,); qw >= 0 after `reset`, then continuous."""
        return self._pose(self._theta(), self._opposite[0])

    def velocity(self) -> np.ndarray:
        """Return velocity [m/s] and angular velocity [rad/s] of the TCP, base axes, (6,).

        In quasi-static mode they are those of the rigid robot.
        """
        chain, inputs = self.chain, self._inputs
        theta, rate = chain.theta(np.stack([inputs.q, inputs.qd]))
        if not self._quasistatic:
            theta, rate = self._theta(), self._theta_rate()
        return tcp_jacobian(chain, self._dynamics.data, theta) @ rate

    def rigid(self) -> np.ndarray:
        """Return the pose of the TCP with undeflected joints [m, 1], (7,), qw as of the elastic one."""
        return self._pose(self.chain.theta(self._inputs.q), self._opposite[1])

    def deviation(self) -> np.ndarray:
        """Return TCP minus rigid TCP [m] and the rotation vector between them [rad], (6,)."""
        rigid = self._rigid_placement().copy()
        tcp = self._elastic_placement()
        offset = tcp.translation - rigid.translation
        return np.append(offset, rotation_between(tcp, rigid))

    def deflection(self) -> np.ndarray:
        """Return the elastic coordinates x [rad], (m,)."""
        return self._now().x

    def deflection_rate(self) -> np.ndarray:
        """Return their rates x' [rad/s], (m,); zero in quasi-static mode."""
        return self._now().v

    def elongation(self) -> np.ndarray:
        """Return the elongations s of the elements of the gears' hysteresis [rad], (e,)."""
        return self._now().elongation

    def gear_torque(self) -> np.ndarray:
        """Return the torque of each gear on its link, about the joint's axis [N m], (torsions,)."""
        return -self._elastic_torque()[self.chain.torsions]

    def motor_torque(self) -> np.ndarray:
        """Return the torque of each motor at its gear's output [N m], (torsions,).

        Of an ideal drive what gives it the commanded motion: its gear's torque, as it feels it, its
        rotor's inertia, the friction of a motor that has slipped; in quasi-static mode its gear's alone.
        """
        gear_torque, joints = self.gear_torque(), self.chain.elastic_joint[self.chain.torsions]
        inputs, frictions = self._inputs, iter(self._parameters.friction)
        torque = gear_torque * self.chain.kinematic_errors.slope(self.motor_angle())[joints]
        if self._motors.drives:
            torque[np.isin(joints, self._motors.joint)] = self._instant().torque
            return torque
        for row, joint in enumerate(joints):
            drive = self._robot.joints[joint].drive
            if drive is not None and not self._quasistatic:
                rate = float(inputs.qd[joint])
                torque[row] += drive.inertia * inputs.qdd[joint]
                torque[row] += drive.friction_torque(
                    next(frictions), np.sign(rate), rate, gear_torque[row]
                )
        return torque

    def motor_angle(self) -> np.ndarray:
        """Return the angles of the motors over the gear ratio [rad], (n,)."""
        return self._motors.joined(self._inputs.q, self._now().motors.angle)

    def motor_rate(self) -> np.ndarray:
        """Return the rates of the motors over the gear ratio [rad/s], (n,)."""
        return self._motors.joined(self._inputs.qd, self._now().motors.rate)

    def rotor_angle(self) -> np.ndarray:
        """Return the angles of the motors that move by themselves [rad], (motors,)."""
        return self._of_motors(self._now().motors.angle)

    def rotor_rate(self) -> np.ndarray:
        """Return their rates [rad/s], (motors,)."""
        return self._of_motors(self._now().motors.rate)

    def servo_integral(self) -> np.ndarray:
        """Return the integrals of their servos [N m], (motors,)."""
        return self._of_motors(self._now().motors.integral)

    def presliding(self) -> np.ndarray:
        """Return the elongations of their friction [rad], (motors,)."""
        return self._of_motors(self._now().motors.presliding)

    def _of_motors(self, values: np.ndarray) -> np.ndarray:
        """Return values of the motors, where all of them move by themselves or none does."""
        return values if self._motors.drives else np.zeros(len(self._parameters.friction))

    def _instant(self) -> MotorInstant:
        """Return what the motors do."""
        motors, inputs = self._now().motors, self._inputs
        return self._motors.at(inputs.commands, motors, self._elastic_torque(), inputs.torque)

    def _elastic_torque(self) -> np.ndarray:
        """Return S + H + d x' [N m], (m,)."""
        state, damping = self._now(), self._parameters.damping
        rate = np.zeros_like(state.v) if self._quasistatic else state.v
        of_elements = self._hysteresis.torque(state.elongation)
        return self._curve.torque(state.x) + of_elements + damping * rate

    def _pose(self, theta: np.ndarray, opposite: bool) -> np.ndarray:
        pose = pose_of(base_from_tool(self.chain, self._dynamics.data, theta))
        if (self._turns.sign(theta, pose[3:]) < 0.0) != opposite:
            pose[3:] *= -1.0
        return pose

    def _rigid_placement(self) -> pin.SE3:
        return base_from_tool(self.chain, self._dynamics.data, self.chain.theta(self._inputs.q))

    def _elastic_placement(self) -> pin.SE3:
        return base_from_tool(self.chain, self._dynamics.data, self._theta())

    def _motor_motion(self) -> np.ndarray:
        """Return q, q', q'' of all motors, at rest in quasi-static mode, (3, n)."""
        if self._quasistatic:
            return self._inputs.commands * [[1.0], [0.0], [0.0]]
        if not self._motors.drives:
            return self._inputs.commands
        motors = self._now().motors
        motion = np.stack([motors.angle, motors.rate, self._instant().acceleration])
        return self._motors.joined(self._inputs.commands, motion)

    def _at_output(self) -> np.ndarray:
        """Return the motion of all drives at their gears' outputs [rad, rad/s, rad/s^2], (3, n)."""
        return self.chain.kinematic_errors.at_output(self._motor_motion())

    def _theta(self) -> np.ndarray:
        """Return the angles of the chain [rad], (angles,)."""
        u = self.chain.kinematic_errors.output_angle(self.motor_angle())
        return self.chain.theta(u, self._now().x)

    def _theta_rate(self) -> np.ndarray:
        """Return their rates [rad/s], (angles,), of a robot that is not quasi-static."""
        slope = self.chain.kinematic_errors.slope(self.motor_angle())
        return self.chain.theta(slope * self.motor_rate(), self._now().v)

    def contact_force(self) -> np.ndarray:
        """Return the force of the contact on the tool [N], (3,); none where it is not touched."""
        if not self._inputs.acting.contact.holds:
            return np.zeros(3)
        return self._contact()[2][0, :3]

    def _contact(self) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        inputs, theta = self._inputs, self._theta()
        if self._quasistatic:
            return self._dynamics.contact_state(
                theta[None], np.zeros((1, len(theta))), inputs.acting.resting
            )
        return self._dynamics.contact_state(theta[None], self._theta_rate()[None], inputs.acting)

    def compliance(self) -> np.ndarray:
        """Return the static compliance of the TCP at the present state, (6, 6).

        Displacement [m] and small rotation [rad] per N and per N m, base axes; with a spring or
        a contact at the TCP the force is shared with it, its anchor at rest.
        """
        return static_sensitivities(*self._at_rest()).tcp.wrench

    def static_sensitivities(self) -> StaticSensitivities:
        """Return the derivatives of equilibrium and TCP by load, drives and parameters."""
        slope = self.chain.kinematic_errors.slope(self.motor_angle())
        return static_sensitivities(*self._at_rest()).by_motors(slope)

    def _at_rest(
        self,
    ) -> tuple[Dynamics, TorqueCurve, np.ndarray, np.ndarray, ToolLoad, HeldHysteresis]:
        state, inputs = self._now(), self._inputs
        hysteresis = self._hysteresis.at_state(state.elongation, state.v)
        u = self._at_output()[0]
        return self._dynamics, self._curve, u, state.x, inputs.acting, hysteresis

    def linearise(self) -> Linearisation:
        """Return the linear robot around the present state; in quasi-static mode, at rest there.

        Raises:
            ParameterError: If motors move by themselves, which are no part of it.
        """
        if self._motors.drives:
            raise ParameterError(
                "linearise: expected ideal drives, got motors that move by themselves"
            )
        damping = self._parameters.damping
        linear = linearise(self._dynamics, self._curve, damping, self._operating_point())
        return linear.by_motors(self._output_by_motor())

    def residual_derivatives(self) -> ResidualDerivatives:
        """Return the derivatives of the equation of motion's residual at the present state."""
        damping = self._parameters.damping
        point = self._operating_point()
        by = residual_derivatives(self._dynamics, self._curve, damping, point)
        return by.by_motors(self._output_by_motor())

    def _output_by_motor(self) -> np.ndarray:
        """Return the derivatives of the drives at their gears' outputs by the motors, (3 n, 3 n)."""
        return self.chain.kinematic_errors.gradient(self._motor_motion())

    def _operating_point(self) -> OperatingPoint:
        state = self._now()
        drives, motion = self._at_output(), np.zeros((3, len(state.x)))
        motion[0] = state.x
        if not self._quasistatic:
            motion[1] = state.v
        acting = self._inputs.acting.resting if self._quasistatic else self._inputs.acting
        hysteresis = self._hysteresis.at_state(state.elongation, state.v)
        motion[2] = free_acceleration(
            self._dynamics, drives, motion[0], motion[1], acting, self._elastic_torque()
        )
        return OperatingPoint(drives, motion, acting, self._curve.region(state.x), hysteresis)

    def _now(self) -> State:
        if self._state is None:
            raise ParameterError("the robot has no state yet; reset it first")
        return self._state
