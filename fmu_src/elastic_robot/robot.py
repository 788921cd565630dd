"""The elastic robot as one object: reset, step, outputs; the same with and without FMI."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from functools import partial

import numpy as np
import pinocchio as pin

from elastic_robot.chain import build_chain
from elastic_robot.collocation import State
from elastic_robot.description import Robot
from elastic_robot.dynamics import Dynamics
from elastic_robot.errors import IntegrationError, ParameterError
from elastic_robot.integrator import GaussStepper, Watch
from elastic_robot.kinematics import base_from_tool, pose_of, rotation_between, tcp_jacobian
from elastic_robot.linearisation import Linearisation, linearise
from elastic_robot.motion import DrivenMotion, Drives
from elastic_robot.parameter_names import ByParameter, parameter_names
from elastic_robot.parameters import Parameters
from elastic_robot.path_sensitivity import (
    ForwardSensitivity,
    PathSensitivity,
    equilibrium_sensitivity,
)
from elastic_robot.residual import (
    OperatingPoint,
    ResidualDerivatives,
    free_acceleration,
    residual_derivatives,
)
from elastic_robot.settings import SETTINGS
from elastic_robot.snapshot import Held, Snapshot
from elastic_robot.static_sensitivity import (
    StaticSensitivities,
    static_sensitivities,
    tcp_compliance,
)
from elastic_robot.statics import equilibrium
from elastic_robot.tool_load import Load
from elastic_robot.torque_curves import TORQUE_CURVES, LinearCurve, TorqueCurve, ways_to_bends
from elastic_robot.turns import Turns

# The matrices of a step serve while no entry of a spring's stiffness changes by more, over its largest.
_SAME_SPRING = 1e-3


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
        self._curve_class = TORQUE_CURVES[torque_curve]
        self._quasistatic = quasistatic
        self._dynamics = Dynamics(self.chain, np.array(robot.gravity))
        play = self._curve_class is not LinearCurve
        self._local_error = SETTINGS.local_error(tolerance, play)
        self._stepper = GaussStepper(self._local_error, reach=self.chain.reach)
        # A contact enlarges errors as a play does.
        in_contact = min(self._local_error, SETTINGS.local_error(tolerance, play=True))
        self._contact_stepper = GaussStepper(in_contact, reach=self.chain.reach)
        self._state: State | None = None
        self._turns, self._opposite = Turns(self.chain), (False, False)
        self.parameters = Parameters.of(robot)

    @property
    def parameters(self) -> Parameters:
        """Stiffness, damping, backlash and gravity; assigning takes effect with the next step."""
        return self._parameters

    @parameters.setter
    def parameters(self, parameters: Parameters) -> None:
        self._parameters = parameters
        self._dynamics.gravity = parameters.gravity
        self._curve: TorqueCurve = self._curve_class.build(parameters)
        self._motion = DrivenMotion(
            self._dynamics,
            self._curve,
            parameters.damping,
            SETTINGS.jump(self._local_error),
        )
        if self._state is not None:
            region = self._curve.region(self._state.x)
            self._state = self._stepper.start(
                self._state.time, self._state.x, self._state.v, region
            )

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

    def reset(self, time: float, drives: Drives, load: Load, undeflected: bool = False) -> None:
        """Start at a time, at rest relative to the drives.

        Args:
            time: Time [s].
            drives: Motion of the drives.
            load: What acts on the tool; of a moving anchor, where it is then.
            undeflected: Start with x = 0 instead of the equilibrium under gravity and load.

        Raises:
            EquilibriumError: If there is no equilibrium.
            TrajectoryError: If the drives are not defined at that time.
        """
        held = Held.at(time, drives, load.at(0.0))
        x = np.zeros(self.chain.elastic_count)
        if not undeflected:
            x = equilibrium(self._dynamics, self._curve, held.q, held.acting)
        self._state = self._stepper.start(time, x, np.zeros_like(x), self._curve.region(x))
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
        held = Held.at(end, drives, load.at(end - state.time))
        if self._quasistatic or self.chain.elastic_count == 0:
            x = equilibrium(self._dynamics, self._curve, held.q, held.acting)
            self._state = replace(state, time=end, x=x, region=self._curve.region(x))
        else:
            state = self._hold(drives, load)
            self._state = self._advance(state, end, held)
        self._held = held

    def _advance(self, state: State, end: float, held: Held, watch: Watch | None = None) -> State:
        """Integrate; an error says what acts at the end, as one of these may have grown too large."""
        try:
            with np.errstate(over="ignore", invalid="ignore"):
                stepper = self._contact_stepper if self._motion.contacting else self._stepper
                return stepper.advance(self._motion, state, end, watch)
        except IntegrationError as error:
            acting, force = held.acting, np.hypot.reduce(held.acting.wrench.reshape(2, 3), axis=1)
            spring = f"a spring of {np.abs(acting.stiffness).max():.3g} N/m, " * acting.has_spring
            spring += f"a contact of {acting.contact.stiffness:.3g} N/m, " * acting.contact.holds
            raise IntegrationError(
                f"{error}, under {force[0]:.3g} N, {force[1]:.3g} N m, {spring}drives of"
                f" {np.abs(held.qd).max():.3g} rad/s and {np.abs(held.qdd).max():.3g} rad/s2: one of"
                " these is too large, or the robot is unstable"
            ) from error

    def _hold(self, drives: Drives, load: Load) -> State:
        """Set what acts from now on; return the state without matrices that are of another spring."""
        state, before, now = self._now(), self._held.acting.stiffness, load.spring.stiffness
        self._motion.hold(drives, load, state.time)
        if now is before or np.abs(now - before).max() <= _SAME_SPRING * np.abs(before).max():
            return state
        return replace(state, newton=None)

    def path_sensitivity(
        self, times: np.ndarray, drives: Drives, loads: Sequence[Load]
    ) -> PathSensitivity:
        """Return how the path from the present state on follows every parameter, in dynamic mode.

        The start is taken as an equilibrium, as `reset` leaves it; the robot ends at the last time.

        Args:
            times: Rising [s], (k,); the first is the present time.
            drives: Motion of the drives.
            loads: What acts on the tool; entry k over the step that ends at times[k], k of them.

        Raises:
            ParameterError: If the first time is not the present one.
            IntegrationError, TrajectoryError: As `step`.
        """
        state = self._now()
        if self._quasistatic:
            raise ParameterError("the robot is quasi-static; path_sensitivity needs dynamic mode")
        if times[0] != state.time:
            raise ParameterError(
                f"times: expected a start at the present time, {state.time:.9g} s, got {times[0]:.9g} s"
            )
        start = equilibrium_sensitivity(
            self._dynamics, self._curve, self._held.q, state.x, self._held.acting
        )
        forward = ForwardSensitivity(self._dynamics, self._curve, self._parameters.damping, start)
        by_x, by_tcp = [], []
        for time, load in zip(times, loads, strict=True):
            state = self._hold(drives, load)
            follow = partial(forward.follow, drives=drives, load=load, since=state.time)
            held = Held.at(time, drives, load.at(time - state.time))
            self._state, self._held = self._advance(state, time, held, follow), held
            theta = self.chain.theta(self._held.q, self._now().x)
            jacobian = tcp_jacobian(self.chain, self._dynamics.data, theta)
            by_x.append(forward.x)
            by_tcp.append(jacobian[:, self.chain.elastic] @ forward.x)
        names = parameter_names(self.chain)
        return PathSensitivity(
            times, ByParameter(names, np.array(by_tcp)), ByParameter(names, np.array(by_x))
        )

    def tcp(self) -> np.ndarray:
        """Return the pose of the elastic robot's TCP, (7,); qw >= 0 after `reset`, then continuous."""
        theta = self.chain.theta(self._held.q, self._now().x)
        return self._pose(theta, self._opposite[0])

    def velocity(self) -> np.ndarray:
        """Return the TCP's velocity [m/s], (3,); in quasi-static mode that of the rigid robot."""
        chain, state = self.chain, self._now()
        x, v = (None, None) if self._quasistatic else (state.x, state.v)
        jacobian = tcp_jacobian(chain, self._dynamics.data, chain.theta(self._held.q, x))
        velocity: np.ndarray = jacobian[:3] @ chain.theta(self._held.qd, v)
        return velocity

    def rigid(self) -> np.ndarray:
        """Return the pose of the TCP with undeflected joints, (7,), as that of the elastic one."""
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

    def deflection_derivative(self) -> np.ndarray:
        """Return the same, as the derivative of `deflection` by time."""
        return self.deflection_rate()

    def rate_derivative(self) -> np.ndarray:
        """Return x'' of the equation of motion [rad/s^2], (m,); zero in quasi-static mode."""
        if self._quasistatic:
            return np.zeros(self.chain.elastic_count)
        return self._operating_point().motion[2]

    def bend(self) -> np.ndarray:
        """Return how far each gear is from the next bends of its torque curve [rad], (torsions, 2)."""
        return ways_to_bends(self._curve, self._now().x)[self.chain.torsions]

    def _pose(self, theta: np.ndarray, opposite: bool) -> np.ndarray:
        pose = pose_of(base_from_tool(self.chain, self._dynamics.data, theta))
        if (self._turns.sign(theta, pose[3:]) < 0.0) != opposite:
            pose[3:] *= -1.0
        return pose

    def _rigid_placement(self) -> pin.SE3:
        return base_from_tool(self.chain, self._dynamics.data, self.chain.theta(self._held.q))

    def _elastic_placement(self) -> pin.SE3:
        theta = self.chain.theta(self._held.q, self._now().x)
        return base_from_tool(self.chain, self._dynamics.data, theta)

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
        state, held = self._now(), self._held
        theta = self.chain.theta(held.q, state.x)
        if self._quasistatic:
            return self._dynamics.contact_state(
                theta[None], np.zeros((1, len(theta))), held.acting.resting
            )
        rate = self.chain.theta(held.qd, state.v)
        return self._dynamics.contact_state(theta[None], rate[None], held.acting)

    def compliance(self) -> np.ndarray:
        """Return the static compliance of the TCP at the present state, (6, 6).

        Displacement [m] and small rotation [rad] per N and per N m, base axes; with a spring or
        a contact at the TCP the force is shared with it, its anchor at rest.
        """
        return tcp_compliance(
            self._dynamics, self._curve, self._held.q, self._now().x, self._held.acting
        )

    def static_sensitivities(self) -> StaticSensitivities:
        """Return how equilibrium and TCP follow load, drives and parameters at the present state."""
        x = self._now().x
        return static_sensitivities(self._dynamics, self._curve, self._held.q, x, self._held.acting)

    def linearise(self) -> Linearisation:
        """Return the linear robot around the present state; in quasi-static mode, at rest there."""
        damping = self._parameters.damping
        return linearise(self._dynamics, self._curve, damping, self._operating_point())

    def residual_derivatives(self) -> ResidualDerivatives:
        """Return the derivatives of the equation of motion's residual at the present state."""
        damping = self._parameters.damping
        return residual_derivatives(self._dynamics, self._curve, damping, self._operating_point())

    def _operating_point(self) -> OperatingPoint:
        state = self._now()
        drives, motion = np.zeros((3, len(self._held.q))), np.zeros((3, len(state.x)))
        drives[0], motion[0] = self._held.q, state.x
        if not self._quasistatic:
            drives[1:], motion[1] = (self._held.qd, self._held.qdd), state.v
        acting = self._held.acting.resting if self._quasistatic else self._held.acting
        point = OperatingPoint(drives, motion, acting, state.region)
        motion[2] = free_acceleration(self._dynamics, self._curve, self._parameters.damping, point)
        return point

    def _now(self) -> State:
        if self._state is None:
            raise ParameterError("the robot has no state yet; reset it first")
        return self._state
