"""What the parameters do to the tool, with the torque that the links need held.

Through the simulation itself small changes grow without bound while a gear is unloaded in its backlash;
through the gear's own equation, d e' + S(e) = T(t), two answers never part (`coupling.inverse.gears`).
The tool moves by J_i de_i/dp.
"""

from __future__ import annotations

from functools import cached_property

import numpy as np
from scipy.interpolate import CubicSpline

from coupling.fit.parameters import RobotParameter
from coupling.inverse.inversion import MovingRobot
from coupling.inverse.spline import UniformSpline
from coupling.inverse.windows import solve_links
from coupling.learn.measurement import MeasuredPath
from coupling.learn.parameters import robot_with
from elastic_robot.description import Robot
from elastic_robot.parameters import Parameters

# Relative change of a parameter for a difference.
_CHANGE = 0.02
# Times between two at which the Jacobian is taken.
_SELDOM = 4


class ParameterEffect:
    """Derivatives of the tool's pose by log factors of the parameters, along one pass.

    Args:
        robot: The robot.
        torque_curve: Name of its gears' torque curve.
        parameters: What is learned.
        one: The pass.
    """

    def __init__(
        self,
        robot: Robot,
        torque_curve: str,
        parameters: tuple[RobotParameter, ...],
        one: MeasuredPath,
    ) -> None:
        self._robot, self._torque_curve, self._parameters = robot, torque_curve, parameters
        self._pass = one
        moving = MovingRobot(robot, torque_curve)
        task = moving.task(one.wanted)
        self.theta: UniformSpline = solve_links(moving.model, task).theta
        self._time = self.theta.nodes
        self._torque = moving.torque(self.theta, self._time, task.wrench)
        at = self.theta.at(self.theta.nodes[::_SELDOM])
        rest = np.zeros_like(at)
        _, by = moving.model.linearised(at, rest, rest, np.zeros((len(at), 6)))
        self._jacobian = CubicSpline(self.theta.nodes[::_SELDOM], by.jacobian)
        self._model = moving.model

    def columns(self, x: np.ndarray, time: np.ndarray) -> np.ndarray:
        """Return displacement [m] and turn [rad] of the tool by log factors, base axes, (n, 6, P).

        Args:
            x: Log factors around which, (P,).
            time: Times [s], (n,).
        """
        model = self._model
        inside = np.clip(time, self.theta.start, self.theta.end)
        jacobian = self._jacobian(inside)
        theta = self.theta.at(inside)
        wind_ups = self._wind_ups(x) if np.any(x) else self._of_file
        rate = self.theta.at(inside, order=1)
        own = Parameters.of(robot_with(self._robot, self._parameters, x))
        settling = own.damping / own.stiffness  # [s]
        columns = np.empty((len(time), 6, len(x)))
        for k, parameter in enumerate(self._parameters):
            if parameter.gear is None:
                angle = int(model.chain.elastic[parameter.coordinate])
                behind = settling[parameter.coordinate] * rate if parameter.vibrates else theta
                moved = -behind[:, angle]
            else:
                angle = int(model.gears[parameter.gear])
                change = wind_ups[parameter.kind] - wind_ups[""]
                moved = np.interp(inside, self._time, change[:, parameter.gear]) / np.log1p(_CHANGE)
            columns[:, :, k] = jacobian[:, :, angle] * moved[:, None]
        return columns

    @cached_property
    def _of_file(self) -> dict[str, np.ndarray]:
        """The gears' wind-ups of the robot of the file, which every part of a pass asks for."""
        return self._wind_ups(np.zeros(len(self._parameters)))

    def _wind_ups(self, x: np.ndarray) -> dict[str, np.ndarray]:
        """Return the gears' wind-up, and with each kind of parameter changed in all gears."""
        wind_ups = {}
        for kind in ("", "backlash", "stiffness", "damping"):
            change = [np.log1p(_CHANGE) * (p.kind == kind) for p in self._parameters]
            robot = robot_with(self._robot, self._parameters, x + np.array(change))
            moving = MovingRobot(robot, self._torque_curve)
            wind_ups[kind] = moving.wind_up(
                self.theta, self._time, self._torque, self._pass.wanted.wrench
            ).angle
        return wind_ups
