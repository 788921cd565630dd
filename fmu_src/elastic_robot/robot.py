"""The elastic robot as one object: reset, step, outputs; the same with and without FMI."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from elastic_robot.chain import build_chain
from elastic_robot.description import Robot
from elastic_robot.dynamics import Dynamics
from elastic_robot.errors import IntegrationError, ParameterError
from elastic_robot.hysteresis import Hysteresis, Past
from elastic_robot.motion import DrivenMotion, State
from elastic_robot.motors import IDEAL, Motors, MotorState, require_drives
from elastic_robot.parameters import Parameters
from elastic_robot.robot_outputs import HeldInputs, RobotOutputs
from elastic_robot.settings import SETTINGS
from elastic_robot.statics import equilibrium
from elastic_robot.tool_load import Load
from elastic_robot.torque_curves import TORQUE_CURVES, TorqueCurve
from elastic_robot.trajectory import Drives
from elastic_robot.turns import Turns


class ElasticRobot(RobotOutputs):
    """An elastic robot in time.

    Args:
        robot: Its description.
        torque_curve: A name of `TORQUE_CURVES`.
        quasistatic: Equilibrium at every step's end instead of the equation of motion.
        tolerance: Error allowed at the TCP over a path [m], in dynamic mode.
        drive: How drives move: one of `motors.DRIVES`; in quasi-static mode they are where commanded.

    Raises:
        ParameterError: If the torque curve is not known, or drives cannot move so.

    Example:
        >>> from elastic_robot.body import Body
        >>> from elastic_robot.description import Joint
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
        drive: str = IDEAL,
    ) -> None:
        if torque_curve not in TORQUE_CURVES:
            raise ParameterError(
                f"torque_curve: expected one of {', '.join(TORQUE_CURVES)}, got {torque_curve!r}"
            )
        require_drives(robot, drive, quasistatic)
        self.chain = build_chain(robot)
        self._robot, self._drive = robot, drive
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
        kind = IDEAL if self._quasistatic else self._drive
        self._motors = Motors.of(self._robot, self.chain, parameters.friction, kind)
        self._law = self._motors.with_friction(self._hysteresis)

    @property
    def time(self) -> float:
        """Present time [s]."""
        return self._now().time

    def reset(
        self,
        time: float,
        drives: Drives,
        load: Load,
        undeflected: bool = False,
        slipped: int = 0,
        torque: np.ndarray | None = None,
    ) -> None:
        """Start at a time, at rest relative to the drives, with servos that hold the motors there.

        Args:
            time: Time [s].
            drives: Motion of the drives.
            load: Loads on the tool; of a moving anchor, its position then.
            undeflected: Start with x = 0 instead of the equilibrium under gravity and load.
            slipped: How the gears went to their equilibrium: 0: from no load; 1: from far below, so that
                all elements of hysteresis slip upwards; -1: from far above.
            torque: Torques of the motors where they have no servos [N m], (d,); None: 0.

        Raises:
            EquilibriumError: If there is no equilibrium.
            TrajectoryError: If the drives are not defined at that time.
        """
        inputs = HeldInputs.at(time, drives, load.at(0.0), torque)
        past = Past.start(self._hysteresis, 0 if undeflected else slipped)
        x = np.zeros(self.chain.elastic_count)
        if not undeflected:
            u = self.chain.kinematic_errors.output_angle(inputs.q)
            x = equilibrium(self._dynamics, self._curve, u, inputs.acting, past)
        angle, rate = inputs.q[self._motors.joint], inputs.qd[self._motors.joint]
        none = np.zeros_like(angle)
        motors = MotorState(angle, rate, none, none)
        self._state = State(time, x, np.zeros_like(x), past.elongation_at(x), motors)
        self._inputs = inputs
        integral = self._motors.holding_integral(inputs.commands, self._elastic_torque())
        self._state = replace(self._state, motors=replace(motors, integral=integral))
        self._opposite = (False, False)
        self._opposite = bool(self.tcp()[6] < 0.0), bool(self.rigid()[6] < 0.0)

    def step(
        self, end: float, drives: Drives, load: Load, torque: np.ndarray | None = None
    ) -> None:
        """Move on to a time under a load; in quasi-static mode the anchor's place there counts.

        Args:
            end: Time to move on to [s].
            drives: Commanded motion of the drives.
            load: Loads on the tool.
            torque: Torques of the motors over the step where they have no servos [N m], (d,); None: 0.

        Raises:
            EquilibriumError, IntegrationError, ParameterError, TrajectoryError: The state is then as
                before.
        """
        state = self._now()
        inputs = HeldInputs.at(end, drives, load.at(end - state.time), torque)
        if self._quasistatic or self.chain.elastic_count == 0:
            past = Past(self._hysteresis, state.x, state.elongation)
            u = self.chain.kinematic_errors.output_angle(inputs.q)
            x = equilibrium(self._dynamics, self._curve, u, inputs.acting, past)
            self._state = replace(state, time=end, x=x, elongation=past.elongation_at(x))
        else:
            self._state = self._advance(state, inputs, end, drives, load)
        self._inputs = inputs
        if self._drive == "torque":  # the rigid robot goes with motors that have no command
            self._inputs = replace(inputs, q=self.motor_angle(), qd=self.motor_rate())

    def _advance(
        self, state: State, inputs: HeldInputs, end: float, drives: Drives, load: Load
    ) -> State:
        """Integrate; an error says what acts at the end, as one of these may have grown too large."""
        damping = self._parameters.damping
        motion = DrivenMotion(
            self._dynamics,
            self._curve,
            damping,
            self._law,
            self._motors,
            self._local_error,
        )
        try:
            with np.errstate(over="ignore", invalid="ignore"):
                return motion.advance(state, end, drives, load, inputs.torque)
        except IntegrationError as cause:
            acting, force = (
                inputs.acting,
                np.hypot.reduce(inputs.acting.wrench.reshape(2, 3), axis=1),
            )
            spring = f"a spring of {np.abs(acting.stiffness).max():.3g} N/m, " * acting.has_spring
            spring += f"a contact of {acting.contact.stiffness:.3g} N/m, " * acting.contact.holds
            raise IntegrationError(
                f"{cause}, under {force[0]:.3g} N, {force[1]:.3g} N m, {spring}drives of"
                f" {np.abs(inputs.qd).max():.3g} rad/s and {np.abs(inputs.qdd).max():.3g} rad/s2: one of"
                " these is too large, or the robot is unstable"
            ) from cause
