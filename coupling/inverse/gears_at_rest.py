"""Wind-up of gears at rest, from which a motion begins."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np

from coupling.inverse.gear_elements import GearElements
from coupling.inverse.gear_path import GearLaw
from coupling.inverse.link_model import LinkModel
from coupling.native.desk_robot import DeskRest
from elastic_robot.chain import build_chain
from elastic_robot.description import Robot
from elastic_robot.dynamics import Dynamics
from elastic_robot.errors import EquilibriumError, RobotFileError
from elastic_robot.hysteresis import Hysteresis, Past
from elastic_robot.settings import SETTINGS
from elastic_robot.statics import equilibrium
from elastic_robot.tool_load import ToolLoad
from elastic_robot.torque_curves import TorqueCurve

# Tries to find the equilibrium that the motion begins in; a smaller change of wind-up is none [rad].
_TRIES, _SAME = 8, 1e-9
# How far beside a command that has no equilibrium another one is tried [rad]: 0.3 um at 3 m reach.
_ASIDE = 1e-7


@dataclass(frozen=True)
class GearsAtRest:
    """Gears of a robot that has not moved yet.

    Attributes:
        robot: The robot.
        model: Motion of its links.
        torque_curve: Name of its gears' torque curve.
        curve: That of all its elastic coordinates.
        gear_curve: That of its gears.
        elements: Elements of the hysteresis of each gear, (gears,).
    """

    robot: Robot
    model: LinkModel
    torque_curve: str
    curve: TorqueCurve
    gear_curve: TorqueCurve
    elements: Sequence[GearElements]

    def alone(self, static: np.ndarray) -> np.ndarray:
        """Return the wind-up of gears by themselves [rad], (gears,), loaded from nothing.

        Args:
            static: Torque of each [N m], (gears,).
        """
        carried = np.where(np.abs(static) < SETTINGS.neutral_torque, 0.0, static)
        wind_up = self.gear_curve.deflection(carried)
        for gear, elements in enumerate(self.elements):
            if elements.count:
                spring, unloaded = GearLaw.of(self.gear_curve, gear), np.zeros(elements.count)
                law = spring.with_elements(elements, 0.0, unloaded)
                wind_up[gear] = law.angle_at(float(carried[gear]))
        return wind_up

    def carrying(self, theta: np.ndarray, wrench: np.ndarray) -> np.ndarray:
        """Return the wind-up of gears that carry their links [rad], (gears,), as a simulation finds it.

        A gear that carries nothing rests in the middle of its backlash.  Rounding in the links must not
        decide that: the equilibrium of the whole robot does.

        Args:
            theta: Angles of the chain [rad], (1, angles).
            wrench: Wrench on the robot at the TCP, base axes [N], [N m], (1, 6).
        """
        chain, no_rate = self.model.chain, np.zeros_like(theta)
        static = -self.model.desk.loads(theta, no_rate, no_rate, wrench)[0, self.model.gears]
        wind_up, rest_at = self.alone(static), self._rest()
        two_before = np.full_like(wind_up, np.inf)
        for number in range(_TRIES):
            output = theta[0, chain.drive].copy()
            output[self.model.gear_joint] -= wind_up
            x = rest_at(output, wrench[0])
            if x is None:
                # A gear between carrying something and nothing: a little beside it is decided.
                wind_up = wind_up - _ASIDE
                continue
            change, wind_up = np.abs(x[chain.torsions] - wind_up), x[chain.torsions]
            if change.max(initial=0.0) < _SAME:
                break
            # Where gears push each other over two states take turns: the last try would find this.
            if number % 2:
                if np.abs(wind_up - two_before).max() < _SAME:
                    break
                two_before = wind_up
        return wind_up

    def _rest(self) -> Callable[[np.ndarray, np.ndarray], np.ndarray | None]:
        """Return the rest as a function of the gears' outputs [rad], (joints,), and a wrench, (6,)."""
        try:
            return DeskRest(self.robot, self.torque_curve).at
        except RobotFileError:
            # A torque table with more points than the library holds, of which the links know nothing.
            return self._python_rest()

    def _python_rest(self) -> Callable[[np.ndarray, np.ndarray], np.ndarray | None]:
        parameters = self.model.parameters
        dynamics = Dynamics(build_chain(self.robot), parameters.gravity)
        unloaded = Past.start(Hysteresis(dynamics.chain.elements, parameters.hysteresis))

        def rest_at(q: np.ndarray, wrench: np.ndarray) -> np.ndarray | None:
            try:
                return equilibrium(dynamics, self.curve, q, ToolLoad(wrench), unloaded)
            except EquilibriumError:
                return None

        return rest_at
