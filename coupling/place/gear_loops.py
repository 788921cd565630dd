"""Backlash and hysteresis of the gears, as far as settings are judged by them."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from coupling.inverse.inversion import MovingRobot
from coupling.inverse.reversals import hysteresis_error
from elastic_robot.parameters import Parameters


@dataclass(frozen=True)
class GearLoops:
    """Gears of one robot, g of them.

    Attributes:
        backlash: Half width of the backlash [rad], (g,).
        stiffness: Stiffness k on a flank, without elements [N m/rad], (g,).
        slip_torque: Torque F at which all elements slip [N m], (g,); 0 without.
        sticking: Stiffness K of the elements before any slips [N m/rad], (g,).
        held_torque: Torque up to which the elements hold a gear in its backlash [N m], (g,).
    """

    backlash: np.ndarray
    stiffness: np.ndarray
    slip_torque: np.ndarray
    sticking: np.ndarray
    held_torque: np.ndarray

    @classmethod
    def of(cls, robot: MovingRobot) -> GearLoops:
        """Return the gears of a robot."""
        elements, backlash = robot.elements, robot.backlash
        stiffness = Parameters.of(robot.robot).stiffness[robot.model.chain.torsions]
        return cls(
            backlash,
            stiffness,
            np.array([elements_of_gear.slip_torque.sum() for elements_of_gear in elements]),
            np.array([elements_of_gear.stiffness.sum() for elements_of_gear in elements]),
            robot.held_in_backlash,
        )

    def hysteresis_error(self, swing: np.ndarray, lever: np.ndarray) -> np.ndarray:
        """Return the error of the tool at rest by slip torques 30 % off [m], (n, g).

        Between two turns of a torque that goes through a range R the elements' torque changes by
        dH = R - k de, and de >= R / (k + K) as long as they do not all slip, so that

            dH <= min(2 F, R K / (k + K)),

        with which the wind-up changes by 0.3 dH / k at most if all slip torques are 30 % off.

        Args:
            swing: Range R of each gear's torque [N m], (n, g).
            lever: Displacement of the TCP by its wind-up [m/rad], (n, g).
        """
        part = self.sticking / (self.stiffness + self.sticking)
        slipping = np.minimum(self.slip_torque, 0.5 * part * swing)
        return hysteresis_error(slipping, self.stiffness, lever)
