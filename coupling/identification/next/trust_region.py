"""Trust region of learning: the command stays as it is where it might make a robot worse.

Whether a gear crosses its backlash under the next command for the first time depends on parameters that
no run has shown.  The inverse of the model counts on the model's values; robots whose parameters are
others explain the runs as well.  Where one of these would deviate more than was measured, nothing is
learned.
"""

from __future__ import annotations

from dataclasses import dataclass, field, replace

import numpy as np
from scipy.ndimage import binary_dilation

from coupling.errors import SimulationError
from coupling.events import unwatched
from coupling.identification.next.command_model import CommandModel
from coupling.identification.next.history import History
from coupling.identification.next.options import NextOptions
from coupling.identification.next.path_learning import (
    PathCorrection,
    PathUpdate,
    squares_around,
)
from coupling.identification.runs.measurement import SimulatedPath
from coupling.identification.runs.parameters import prior_of
from coupling.identification.runs.slow_part import SlowPart
from coupling.path.deviation import less_constant
from coupling.path.joint_path import JointPath
from coupling.run.fmu_pool import FmuPool

# How far around a place where a robot is worse nothing is learned [s], in each correction that is tried.
_BESIDE = (0.25, 0.5, 1.0, 2.0)
# A place is worse by this factor of the mean square.
_WORSE = 1.2
# A robot explains a run as the model does if it leaves no more than this factor of its mean square;
# steps of a parameter that are tried, each shorter than in proportion to the root of that.
_AS_WELL, _STEPS, _SHORTER = 1.05, 3, 0.8
# Deviation of the model's tool that a command need not be improved on [m], and simulations to get there:
# a command that takes more is none that another robot could follow.
_GOAL, _SIMULATIONS = 1e-6, 40


def restrict_learning(
    update: PathUpdate,
    history: History,
    model: CommandModel,
    options: NextOptions,
    models: FmuPool,
) -> PathCorrection:
    """Return the correction of an update, with gain 0 where a plausible robot would be worse.

    It is 0 along the whole path where robots are worse with each of `_BESIDE`.

    Args:
        history: The runs.
        model: The robot's model, under which the last command was computed.
        options: Repeatability, and whether the constant counts.
        models: Simulation models of the robots.

    Raises:
        PlanningError: If there is no command for the correction.
        SimulationError: If the model cannot be simulated.
    """
    source, robots = history.sources[-1], PlausibleRobots(update, history, model.x, options)
    inverter = models.inverter(history.robot_at(model.x), source.torque_curve, source.drive)
    inverter = replace(inverter, simulations=min(inverter.simulations, _SIMULATIONS))
    motion, spacing = source.desired_motion, float(update.time[1] - update.time[0])
    trust, worse = np.ones(len(update.time)), np.zeros(len(update.time), dtype=bool)
    for beside in (0.0, *_BESIDE):
        near = binary_dilation(worse, iterations=max(round(beside / spacing), 1))
        trust = np.where(near, 0.0, trust)
        correction = update.correction(trust)
        shifted = replace(motion, path=correction.discrepancy(history).model(motion.path))
        command = inverter.invert(shifted, source.controller, _GOAL, unwatched).joints
        worse = robots.worse_places(command)
        if not np.any(worse):
            return correction
    return update.correction(0.0)


@dataclass
class PlausibleRobots:
    """Robots that differ from a model in one parameter, as far as the measured runs allow it.

    Attributes:
        update: Update of the correction.
        history: The runs.
        x: Log factors of the model [1], (P,).
        options: Repeatability, and whether the constant counts.
    """

    update: PathUpdate
    history: History
    x: np.ndarray
    options: NextOptions
    _steps: list[np.ndarray] = field(init=False)
    _allowed: set[int] = field(default_factory=lambda: {0})

    def __post_init__(self) -> None:
        parameters = self.history.parameters
        of_gears = [parameter.gear is not None for parameter in parameters]
        prior = np.diag(prior_of(parameters))[of_gears]
        self._steps = [np.zeros(len(self.x)), *prior, *-prior]

    def worse_places(self, command: JointPath) -> np.ndarray:
        """Return whether a robot would be worse under a command, at the times [1], (n,)."""
        limit = _WORSE * self.update.squares + self.options.random**2
        worse = np.zeros(len(limit), dtype=bool)
        for number, step in enumerate(self._steps):
            over = self._squares(command, self.x + step) > limit
            # How far runs allow a parameter to be off is only asked of those that matter.
            if over.any() and number not in self._allowed:
                self._steps[number] = self._allowed_step(step)
                self._allowed.add(number)
                over = self._squares(command, self.x + self._steps[number]) > limit
            worse |= over
        return worse

    def _squares(self, command: JointPath, x: np.ndarray) -> np.ndarray:
        """Return mean squares that a robot is expected to leave under a command [m^2], (n,).

        They are infinite of a robot that cannot be simulated.
        """
        history, update, wrench = self.history, self.update, self.history.sources[-1].stored.wrench
        squares = np.zeros(len(update.time))
        try:
            path = history.fmu.simulate(command, wrench, "dynamic", history.robot_at(x))
            for number in np.unique(update.base).tolist():
                run = history.runs[number]
                before = history.simulated(number, x).position(run.measured.time)
                change = SimulatedPath(path).position(run.measured.time) - before
                now = squares_around(update.time, run, run.deviation + change, self.options)
                squares = np.where(update.base == number, now, squares)
        except SimulationError:
            return np.full(len(squares), np.inf)
        return squares

    def _allowed_step(self, step: np.ndarray) -> np.ndarray:
        """Return a step of the log factors, shortened until runs allow it, or 0 [1], (P,)."""
        least = self._unexplained(self.x)
        for _ in range(_STEPS):
            try:
                more = float(np.max(self._unexplained(self.x + step) / least))
            except SimulationError:  # no robot
                break
            if more <= _AS_WELL:
                return step
            step = step * _SHORTER * float(np.sqrt((_AS_WELL - 1.0) / (more - 1.0)))
        return np.zeros(len(step))

    def _unexplained(self, x: np.ndarray) -> np.ndarray:
        """Return mean squares of what a robot does not explain of the runs [m^2], (runs,)."""
        squares = []
        for number, run in enumerate(self.history.runs):
            low_pass = SlowPart.of(run.measured.time)
            slow = low_pass(self.history.unmodelled(number, x)[:, :3])
            squares.append(np.mean(np.sum(less_constant(low_pass.time, slow) ** 2, axis=1)))
        return np.array(squares)
