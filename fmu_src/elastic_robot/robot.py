"""The elastic robot as one object: reset, step, outputs; the same with and without FMI."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pinocchio as pin

from elastic_robot.chain import build_chain
from elastic_robot.description import Robot
from elastic_robot.dynamics import Dynamics
from elastic_robot.errors import IntegrationError, ParameterError
from elastic_robot.hysteresis import HeldHysteresis, Hysteresis, Past
from elastic_robot.kinematics import base_from_tool, pose_of, rotation_between, tcp_jacobian
from elastic_robot.linearisation import Linearisation, linearise
from elastic_robot.motion import DrivenMotion, Drives, DrivesAtOutput, State
from elastic_robot.parameters import Parameters
from elastic_robot.residual import (
    OperatingPoint,
    ResidualDerivatives,
    free_acceleration,
    residual_derivatives,
)
from elastic_robot.settings import SETTINGS
from elastic_robot.snapshot import HeldInputs, Snapshot
from elastic_robot.static_sensitivity import (
    StaticSensitivities,
    static_sensitivities,
    tcp_compliance,
)
from elastic_robot.statics import equilibrium
from elastic_robot.tool_load import Load, ToolLoad
from elastic_robot.torque_curves import TORQUE_CURVES, TorqueCurve, ways_to_bends
from elastic_robot.turns import Turns


class ElasticRobot:
    """An elastic robot in time.

    Args:
        robot: Its description.
        torque_curve: A name of `TORQUE_CURVES`.
        quasistatic: Equilibrium at every step's end instead of the equation of motion.
        tolerance: Error allowed at the TCP over a path [m], in dynamic mode.

    Raises:
        ParameterError: If the torque curve is not known.

    Example:
        >>> from elastic_robot.description import Body, Joint
        >>> from elastic_robot.trajectory import HeldCommand
        >>> link = Body(mass=10.0, com=(0.5, 0.0, 0.0), inertia=(0.1, 1.0, 1.0))
        >>> joint = Joint((0.0, 0.0, 0.0), (0.0, 1.0, 0.0), link, stiffness=1e5, damping=1e3)
        >>> arm = ElasticRobot(Robot("arm", joints=(joint,), tcp_position=(1.0, 0.0, 0.0)))
        >>> rest = HeldCommand(0.0, np.zeros(1), np.zeros(1), np.zeros(1))
        >>> arm.reset(0.0, rest, Load())
        >>> float(arm.deviation()[2].round(6))  # sags by 10 kg at 0.5 m over the stiffness [m]
        -0.00049
        >>> arm.step(0.5, rest, Load(np.array([0.0, 0.0, -100.0, 0.0, 0.0, 0.0])))
        >>> float(arm.deviation()[2].round(6))  # and by 100 N at 1 m
        -0.00149
    """

    def __init__(
        self,
        robot: Robot,
        torque_curve: str = "backlash",
        quasistatic: bool = False,
        tolerance: float = 1e-6,
    ) -> None:
        if torque_curve not in TORQUE_CURVES:
            raise ParameterError(
                f"torque_curve: expected one of {', '.join(TORQUE_CURVES)}, got {torque_curve!r}"
            )
        self.chain = build_chain(robot)
        self._drives = [joint.drive for joint in robot.joints]
        self._curve_class = TORQUE_CURVES[torque_curve]
        self._quasistatic = quasistatic
        self._dynamics = Dynamics(self.chain, np.array(robot.gravity))
        self._local_error = tolerance / SETTINGS.tcp_per_local_error_with_backlash
        self._state: State | None = None
        self._turns, self._opposite = Turns(self.chain), (False, False)
        self.parameters = Parameters.of(robot)

    @property
    def parameters(self) -> Parameters:
        """Gravity and the numbers of the gears; assigning takes effect with the next step."""
        return self._parameters

    @parameters.setter
    def parameters(self, parameters: Parameters) -> None:
        self._parameters = parameters
        self._dynamics.gravity = parameters.gravity
        self._curve: TorqueCurve = self._curve_class.build(parameters)
        self._hysteresis = Hysteresis(self.chain.elements, parameters.hysteresis)

    @property
    def snapshot(self) -> Snapshot:
        """The present state; assigning one of the same robot goes on from there, bit for bit."""
        return Snapshot(self._now(), self._held, self._parameters, self._opposite)

    @snapshot.setter
    def snapshot(self, snapshot: Snapshot) -> None:
        if snapshot.parameters is not self._parameters:
            self.parameters = snapshot.parameters
        self._state, self._held = snapshot.state, snapshot.held
        self._opposite = snapshot.opposite

    @property
    def time(self) -> float:
        """Present time [s]."""
        return self._now().time

    def reset(
        self, time: float, drives: Drives, load: Load, undeflected: bool = False, slipped: int = 0
    ) -> None:
        """Start at a time, at rest relative to the drives.

        Args:
            time: Time [s].
            drives: Motion of the drives.
            load: Loads on the tool; of a moving anchor, its position then.
            undeflected: Start with x = 0 instead of the equilibrium under gravity and load.
            slipped: How the gears went to their equilibrium: 0: from no load; 1: from far below, so that
                all elements of hysteresis slip upwards; -1: from far above.

        Raises:
            EquilibriumError: If there is no equilibrium.
            TrajectoryError: If the drives are not defined at that time.
        """
        held = HeldInputs.at(time, drives, load.at(0.0))
        past = Past.start(self._hysteresis, 0 if undeflected else slipped)
        x = np.zeros(self.chain.elastic_count)
        if not undeflected:
            u = self._at_output(held)[0]
            x = equilibrium(self._dynamics, self._curve, u, held.acting, past)
        self._state = State(time, x, np.zeros_like(x), past.elongation_at(x))
        self._held = held
        self._opposite = (False, False)
        self._opposite = bool(self.tcp()[6] < 0.0), bool(self.rigid()[6] < 0.0)

    def step(self, end: float, drives: Drives, load: Load) -> None:
        """Move on to a time under a load; in quasi-static mode the anchor's place there counts.

        Raises:
            EquilibriumError, IntegrationError, ParameterError, TrajectoryError: The state is then as
                before.
        """
        state = self._now()
        held = HeldInputs.at(end, drives, load.at(end - state.time))
        if self._quasistatic or self.chain.elastic_count == 0:
            past = Past(self._hysteresis, state.x, state.elongation)
            u = self._at_output(held)[0]
            x = equilibrium(self._dynamics, self._curve, u, held.acting, past)
            self._state = replace(state, time=end, x=x, elongation=past.elongation_at(x))
        else:
            self._state = self._advance(state, held, end, drives, load)
        self._held = held

    def _advance(
        self, state: State, held: HeldInputs, end: float, drives: Drives, load: Load
    ) -> State:
        """Integrate; an error says what acts at the end, as one of these may have grown too large."""
        damping = self._parameters.damping
        at_output = DrivesAtOutput(drives, self.chain.kinematic_errors)
        motion = DrivenMotion(
            self._dynamics, self._curve, damping, self._hysteresis, self._local_error
        )
        try:
            with np.errstate(over="ignore", invalid="ignore"):
                return motion.advance(state, end, at_output, load)
        except IntegrationError as cause:
            acting, force = held.acting, np.hypot.reduce(held.acting.wrench.reshape(2, 3), axis=1)
            spring = f"a spring of {np.abs(acting.stiffness).max():.3g} N/m, " * acting.has_spring
            spring += f"a contact of {acting.contact.stiffness:.3g} N/m, " * acting.contact.holds
            raise IntegrationError(
                f"{cause}, under {force[0]:.3g} N, {force[1]:.3g} N m, {spring}drives of"
                f" {np.abs(held.qd).max():.3g} rad/s and {np.abs(held.qdd).max():.3g} rad/s2: one of"
                " these is too large, or the robot is unstable"
            ) from cause

    def tcp(self) -> np.ndarray:
        """Return the pose of the elastic TCP [m, 1], (7,); qw >= 0 after `reset`, then continuous."""
        return self._pose(self._theta(), self._opposite[0])

    def velocity(self) -> np.ndarray:
        """Return velocity [m/s] and angular velocity [rad/s] of the TCP, base axes, (6,).

        In quasi-static mode they are those of the rigid robot.
        """
        chain, held = self.chain, self._held
        theta, rate = chain.theta(held.q), chain.theta(held.qd)
        if not self._quasistatic:
            theta, rate = self._theta(), self._theta_rate()
        velocity: np.ndarray = tcp_jacobian(chain, self._dynamics.data, theta) @ rate
        return velocity

    def rigid(self) -> np.ndarray:
        """Return the pose of the TCP with undeflected joints [m, 1], (7,), qw as of the elastic one."""
        return self._pose(self.chain.theta(self._held.q), self._opposite[1])

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

    def elongation_derivative(self) -> np.ndarray:
        """Return s' [rad/s], (e,); zero in quasi-static mode."""
        return self._hysteresis.rate(self._now().elongation, self._now().v)

    def slip(self) -> np.ndarray:
        """Return how far the elements are from sticking or slipping instead [rad], (e,)."""
        return self._hysteresis.ways(self._now().elongation, self._now().v)

    def deflection_derivative(self) -> np.ndarray:
        """Return x' [rad/s], (m,), as the derivative of `deflection` by time."""
        return self.deflection_rate()

    def rate_derivative(self) -> np.ndarray:
        """Return x'' of the equation of motion [rad/s^2], (m,); zero in quasi-static mode."""
        if self._quasistatic:
            return np.zeros(self.chain.elastic_count)
        return self._operating_point().motion[2]

    def bend(self) -> np.ndarray:
        """Return the distances of gears from the next bends of their curves [rad], (torsions, 2)."""
        return ways_to_bends(self._curve, self._now().x)[self.chain.torsions]

    def gear_torque(self) -> np.ndarray:
        """Return the torque of each gear on its link, about the joint's axis [N m], (torsions,)."""
        state, damping = self._now(), self._parameters.damping
        rate = np.zeros_like(state.v) if self._quasistatic else state.v
        of_elements = self._hysteresis.torque(state.elongation)
        return -(self._curve.torque(state.x) + of_elements + damping * rate)[self.chain.torsions]

    def motor_torque(self) -> np.ndarray:
        """Return the torque of each motor at its gear's output [N m], (torsions,).

        What gives it the commanded motion: its gear's torque, as it feels it, its rotor's inertia, the
        friction of a motor that has slipped; in quasi-static mode the gear's torque alone.
        """
        carried, joints = self.gear_torque(), self.chain.elastic_joint[self.chain.torsions]
        held, frictions = self._held, iter(self._parameters.friction)
        torque = carried * self.chain.kinematic_errors.slope(held.q)[joints]
        for row, joint in enumerate(joints):
            drive = self._drives[joint]
            if drive is not None and not self._quasistatic:
                rate = float(held.qd[joint])
                torque[row] += drive.inertia * held.qdd[joint]
                torque[row] += drive.friction_torque(
                    next(frictions), np.sign(rate), rate, carried[row]
                )
        return torque

    def motor_angle(self) -> np.ndarray:
        """Return the angles of the motors over the gear ratio [rad], (n,)."""
        return self._held.q

    def motor_rate(self) -> np.ndarray:
        """Return the rates of the motors over the gear ratio [rad/s], (n,)."""
        return self._held.qd

    def _pose(self, theta: np.ndarray, opposite: bool) -> np.ndarray:
        pose = pose_of(base_from_tool(self.chain, self._dynamics.data, theta))
        if (self._turns.sign(theta, pose[3:]) < 0.0) != opposite:
            pose[3:] *= -1.0
        return pose

    def _rigid_placement(self) -> pin.SE3:
        return base_from_tool(self.chain, self._dynamics.data, self.chain.theta(self._held.q))

    def _elastic_placement(self) -> pin.SE3:
        return base_from_tool(self.chain, self._dynamics.data, self._theta())

    def _at_output(self, held: HeldInputs) -> np.ndarray:
        """Return the motion of the drives at their gears' outputs [rad, rad/s, rad/s^2], (3, n)."""
        return self.chain.kinematic_errors.at_output(np.stack([held.q, held.qd, held.qdd]))

    def _theta(self) -> np.ndarray:
        """Return the angles of the chain [rad], (angles,)."""
        return self.chain.theta(self._at_output(self._held)[0], self._now().x)

    def _theta_rate(self) -> np.ndarray:
        """Return their rates [rad/s], (angles,)."""
        return self.chain.theta(self._at_output(self._held)[1], self._now().v)

    def contact_force(self) -> np.ndarray:
        """Return the force of the contact on the tool [N], (3,); none where it is not touched."""
        if not self._held.acting.contact.holds:
            return np.zeros(3)
        force: np.ndarray = self._contact()[2][0, :3]
        return force

    def contact_gap(self) -> np.ndarray:
        """Return the way from the sphere at the TCP to the contact's plane [m], (1,); 1 without one."""
        return -self._contact()[0] if self._held.acting.contact.holds else np.ones(1)

    def _contact(self) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        held, theta = self._held, self._theta()
        if self._quasistatic:
            return self._dynamics.contact_state(
                theta[None], np.zeros((1, len(theta))), held.acting.resting
            )
        return self._dynamics.contact_state(theta[None], self._theta_rate()[None], held.acting)

    def compliance(self) -> np.ndarray:
        """Return the static compliance of the TCP at the present state, (6, 6).

        Displacement [m] and small rotation [rad] per N and per N m, base axes; with a spring or
        a contact at the TCP the force is shared with it, its anchor at rest.
        """
        return tcp_compliance(*self._at_rest())

    def static_sensitivities(self) -> StaticSensitivities:
        """Return the derivatives of equilibrium and TCP by load, drives and parameters."""
        slope = self.chain.kinematic_errors.slope(self._held.q)
        return static_sensitivities(*self._at_rest()).by_motors(slope)

    def _at_rest(
        self,
    ) -> tuple[Dynamics, TorqueCurve, np.ndarray, np.ndarray, ToolLoad, HeldHysteresis]:
        state, held = self._now(), self._held
        hysteresis = self._hysteresis.held(state.elongation, state.v)
        u = self._at_output(held)[0]
        return self._dynamics, self._curve, u, state.x, held.acting, hysteresis

    def linearise(self) -> Linearisation:
        """Return the linear robot around the present state; in quasi-static mode, at rest there."""
        damping = self._parameters.damping
        linear = linearise(self._dynamics, self._curve, damping, self._operating_point())
        return linear.by_motors(self._output_by_motor())

    def residual_derivatives(self) -> ResidualDerivatives:
        """Return the derivatives of the equation of motion's residual at the present state."""
        damping = self._parameters.damping
        point = self._operating_point()
        by = residual_derivatives(self._dynamics, self._curve, damping, point)
        return by.by_motors(self._output_by_motor())

    def _moved(self) -> np.ndarray:
        """Return q, q', q'' of the motors, at rest in quasi-static mode, (3, n)."""
        held, moves = self._held, not self._quasistatic
        return np.stack([held.q, moves * held.qd, moves * held.qdd])

    def _output_by_motor(self) -> np.ndarray:
        """Return the derivatives of the drives at their gears' outputs by the motors, (3 n, 3 n)."""
        return self.chain.kinematic_errors.gradient(self._moved())

    def _operating_point(self) -> OperatingPoint:
        state = self._now()
        drives, motion = (
            self.chain.kinematic_errors.at_output(self._moved()),
            np.zeros((3, len(state.x))),
        )
        motion[0] = state.x
        if not self._quasistatic:
            motion[1] = state.v
        acting = self._held.acting.resting if self._quasistatic else self._held.acting
        hysteresis = self._hysteresis.held(state.elongation, state.v)
        point = OperatingPoint(drives, motion, acting, self._curve.region(state.x), hysteresis)
        motion[2] = free_acceleration(self._dynamics, self._curve, self._parameters.damping, point)
        return point

    def _now(self) -> State:
        if self._state is None:
            raise ParameterError("the robot has no state yet; reset it first")
        return self._state
