"""A robot fitted to its responses in several postures, linearised where it rests with fitted springs."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from coupling.files.modal_damping import with_damping_ratio
from coupling.identification.response.experiment import DELAY, PostureResponse, ResponseExperiment
from coupling.identification.response.fit import ResponseFit, fit_responses
from coupling.identification.response.posture import (
    DELAY_DEVIATION,
    FACTOR_DEVIATION,
    MeasuredPosture,
)
from coupling.modes.locked_robot import LockedRobot
from coupling.robot.parameters import apply_values
from elastic_robot.chain import build_chain
from elastic_robot.description import Robot
from elastic_robot.parameters import Parameters

# Standard deviations of the logs that are known before: a data sheet's or a class's stiffness, and a
# damping ratio of 0.04, which measured robots have within a factor of 2 to 3 [1].
_STIFFNESS, _DAMPING, _RATIO = 0.4, 1.0, 0.04
# Times that the robot is linearised: under its weight it rests elsewhere with other springs.
_LINEARISED = 3


@dataclass(frozen=True)
class RobotFit:
    """A fitted robot in all postures, those held out as well.

    Attributes:
        experiment: The responses that were fitted.
        fit: The fit.
        postures: The robot in all postures.
        unloaded: Numbers of the joints in each of them whose gears are in their backlash.
    """

    experiment: ResponseExperiment
    fit: ResponseFit
    postures: tuple[PostureResponse, ...]
    unloaded: tuple[tuple[int, ...], ...]

    @classmethod
    def of(cls, robot: Robot, torque_curve: str, measured: Sequence[MeasuredPosture]) -> RobotFit:
        """Fit a robot.

        Args:
            robot: The start, with elastic joints.
            torque_curve: A name of `TORQUE_CURVES`.
            measured: Postures, one at least that is not held out.

        Raises:
            StabilityError: If the robot has no equilibrium in a posture.
        """
        stiffness = Parameters.of(robot).stiffness
        damping = Parameters.of(with_damping_ratio(robot, _RATIO)).damping
        fitted = [not each.is_held_out for each in measured]
        instruments = np.tile([FACTOR_DEVIATION, DELAY_DEVIATION / DELAY], sum(fitted))
        prior = np.append(np.repeat([_STIFFNESS, _DAMPING], len(stiffness)), instruments)
        around, fit = robot, None
        for _ in range(_LINEARISED):
            postures, unloaded = _linearise(around, torque_curve, measured)
            chosen = tuple(p for p, is_fitted in zip(postures, fitted, strict=True) if is_fitted)
            experiment = ResponseExperiment(chosen, stiffness, damping, prior, 1.0)
            fit = fit_responses(experiment, np.full(len(prior), np.nan), fit)
            names = build_chain(robot).elastic_names
            springs = experiment.parameters(fit.x)[0].tolist()
            around = apply_values(
                robot, {f"{name}.stiffness": k for name, k in zip(names, springs, strict=True)}
            )
        assert fit is not None
        return cls(experiment, fit, postures, unloaded)

    @property
    def values(self) -> np.ndarray:
        """Fitted stiffnesses and dampings [N m/rad, N m s/rad], (2 m,)."""
        return np.concatenate(self.experiment.parameters(self.fit.x))


def _linearise(
    robot: Robot, torque_curve: str, measured: Sequence[MeasuredPosture]
) -> tuple[tuple[PostureResponse, ...], tuple[tuple[int, ...], ...]]:
    """Return the robot in all postures, and the joints whose gears are unloaded there."""
    locked, stiffness = LockedRobot(robot, torque_curve), Parameters.of(robot).stiffness
    linear = [locked.linear(each.q, np.zeros(6)) for each in measured]
    postures = [
        PostureResponse.of(there, stiffness, each.responses)
        for there, each in zip(linear, measured, strict=True)
    ]
    return tuple(postures), tuple(map(locked.unloaded_joints, linear))
