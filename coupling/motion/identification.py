"""Identification from motion as a whole: fit, judge, predict what was held out, leave terms out."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from coupling.errors import IdentifyError
from coupling.motion.fit import MotionFit, fitted, told
from coupling.motion.moved_robot import MovedRobot
from coupling.motion.parameters import motion_parameters
from coupling.motion.problem import MotionProblem, MovedRecording, Parameter
from coupling.motion.recording import Recording
from coupling.motion.sensors import sensor_parameters
from elastic_robot.description import Robot


@dataclass(frozen=True)
class Judged:
    """How well a recording is predicted.

    Attributes:
        name: The recording's.
        held_out: Whether it was not fitted.
        wind_up: Rms of what is left of motor less link [rad], (j,); nan without encoder.
        torque: Rms of what is left of the motors' torques over that of the torques, (j,).
    """

    name: str
    held_out: bool
    wind_up: np.ndarray
    torque: np.ndarray


@dataclass(frozen=True)
class MotionIdentification:
    """What recordings tell of a robot.

    Attributes:
        robot: The start.
        first: The fit of all parameters.
        fit: The fit of those that are told.
        kept: Those that are not, as in the start.
        judged: Recordings, those fitted first.
    """

    robot: Robot
    first: MotionFit
    fit: MotionFit
    kept: tuple[Parameter, ...]
    judged: tuple[Judged, ...]


def identify_motion(
    robot: Robot, recordings: Sequence[Recording], held_out: Sequence[Recording], bandwidth: float
) -> MotionIdentification:
    """Identify a robot from recordings of its motion.

    Args:
        robot: The start.
        recordings: What is fitted.
        held_out: What is predicted.
        bandwidth: Of the motors' smoothed motion [Hz].

    Raises:
        IdentifyError: If the recordings do not have the same encoders.
        SimulationError: If the start cannot be simulated along them.
    """
    with_link = recordings[0].with_link
    for recording in (*recordings, *held_out):
        if recording.with_link != with_link:
            raise IdentifyError(
                f"{recording.name}: expected the links' angles that {recordings[0].name} has"
            )
    moved = [MovedRecording.of(recording, bandwidth) for recording in recordings]
    others = [MovedRecording.of(recording, bandwidth) for recording in held_out]
    count = len(robot.joints)
    with MovedRobot(robot) as fmu:
        parameters: tuple[Parameter, ...] = (
            *motion_parameters(robot, with_link),
            *sensor_parameters(with_link),
        )
        problem = MotionProblem(
            fmu, robot, parameters, tuple(moved), np.ones(count), np.ones(count)
        )
        first = fitted(problem)
        chosen = told(first)
        fit = first
        if not chosen.all():
            fit = fitted(first.problem.only(chosen), first.x[chosen])
        kept = tuple(p for p, own in zip(parameters, chosen, strict=True) if not own)
        judged = [
            _judged(fit.problem, one, fit.x, any(one is o for o in others))
            for one in (*moved, *others)
        ]
    return MotionIdentification(robot, first, fit, kept, tuple(judged))


def _judged(problem: MotionProblem, moved: MovedRecording, x: np.ndarray, held_out: bool) -> Judged:
    wind_up, torque = problem.left(moved, problem.predicted(moved, x))
    measured = moved.recording.torque
    return Judged(
        moved.recording.name,
        held_out,
        np.sqrt(np.mean(wind_up**2, axis=0)),
        np.sqrt(np.mean(torque**2, axis=0) / np.mean(measured**2, axis=0)),
    )
