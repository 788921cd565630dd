"""What the parameters do to the tool near the solution: differences of simulations.

The gears' own equation (`coupling.learn.effect`) leads near the solution but not into it, since the
torques that it holds are not quite those of the robot that moves.  Near the solution finite changes of
some per cent, whose effect is looked at slowly, lead the rest of the way.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from coupling.fit.parameters import RobotParameter
from coupling.learn.effect import ParameterEffect
from coupling.learn.measurement import MeasuredPath
from coupling.learn.parameters import changed
from coupling.learn.side_by_side import side_by_side
from coupling.robot.robot_fmu import RobotFmu

# Parameters whose standard deviation before moves the tool by less [m], and turns it by less where that
# is measured [rad], are left to the gears' equation.
_NEGLIGIBLE, _NEGLIGIBLE_TURN = 3e-7, 1e-6


class SecantEffect:
    """Derivatives of the tool's pose by log factors along one pass, by simulation.

    Args:
        fmus: What simulates the robot of the file, side by side.
        parameters: What is learned.
        prior: Standard deviations of the log factors before, (P,).
        one: The pass.
        effect: The gears' equation, for what hardly matters.
        change: Change of a log factor for a difference: large beside where an unloaded gear forgets its
            past, small in the valley.

    Attributes:
        shown: Numbers of the parameters that matter.
    """

    def __init__(
        self,
        fmus: Sequence[RobotFmu],
        parameters: tuple[RobotParameter, ...],
        prior: np.ndarray,
        one: MeasuredPath,
        effect: ParameterEffect,
        change: float,
    ) -> None:
        self._fmus, self._parameters, self._pass = fmus, parameters, one
        self._change = change
        self._time = one.seen.time
        # What is left to the equation is left as it is for the parameters of the file.
        self._plain = effect.columns(np.zeros(len(parameters)), self._time)
        moved = self._plain - self._plain.mean(axis=0)
        shifts, turns = (
            prior * np.sqrt(np.mean(np.sum(own**2, axis=1), axis=0))
            for own in (moved[:, :3], moved[:, 3:])
        )
        turned = turns > _NEGLIGIBLE_TURN if one.held is not None else False
        vibrates = np.array([own.vibrates for own in parameters])
        self.shown = np.flatnonzero((shifts > _NEGLIGIBLE) | turned | vibrates)

    def columns(self, x: np.ndarray, time: np.ndarray) -> np.ndarray:
        """Return displacement [m] and turn [rad] of the tool by log factors, base axes, (n, 6, P).

        Args:
            x: Log factors around which, (P,).
            time: Times of the measurement, but for its clock [s], (n,).
        """
        columns = self._plain.copy()
        # Towards what was known before, where the robot is better known.
        steps = np.diag(np.where(x > 0.0, -self._change, self._change))[self.shown]
        here, *aside = self._poses([x, *(x + steps)], time)
        for k, there in zip(self.shown, aside, strict=True):
            columns[:, :, k] = (there - here) / (-self._change if x[k] > 0.0 else self._change)
        return columns

    def _poses(self, points: Sequence[np.ndarray], time: np.ndarray) -> list[np.ndarray]:
        """Return how the tool stands for several log factors."""

        def pose(fmu: RobotFmu, x: np.ndarray) -> np.ndarray:
            return self._pass.simulated(fmu, changed(self._parameters, x)).pose(time)

        return side_by_side(self._fmus, points, pose)
