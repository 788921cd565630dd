"""Identification from motion as a whole: fit, predict what was held out, leave terms out."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from coupling.errors import IdentifyError
from coupling.identification.motion.fit import (
    MotionFit,
    estimate_slow_errors,
    fit_motion,
    fit_roughly,
    fit_with_restarts,
    rms,
    select_backlashes,
)
from coupling.identification.motion.identifiability import identifiable, narrow, returns
from coupling.identification.motion.moved_robot import MovedRobot
from coupling.identification.motion.parameters import MotionParameter, motion_parameters
from coupling.identification.motion.problem import MotionProblem, MovedRecording
from coupling.identification.motion.recording import Recording
from coupling.identification.motion.residuals import (
    RecordingResiduals,
    TermLeftOut,
    remarks_on,
    residuals_of,
    terms_left_out,
)
from coupling.identification.motion.sensors import (
    SensorParameter,
    encoder_lines,
    sensor_parameters,
    torque_parameters,
)
from coupling.identification.motor_torques import MotorTorques, torque_remarks
from elastic_robot.description import Robot

# Fits at most, each of what the one before identifies.
_MOST_ITERATIONS = 4
# Part of a motor's torque that, left by a fit, shows that it is another joint's or in another unit [1].
_MORE_THAN_ALL = 1.03


@dataclass(frozen=True)
class MotionIdentification:
    """What recordings identify of a robot.

    Attributes:
        robot: The start.
        bandwidth: Bandwidth of the motors' smoothed motion [Hz].
        parameters: All parameters, P of them.
        fit: The fit of those that are identifiable, and of what is known before.
        chosen: Mask of those identified among all, (P,).
        residuals: Those of all recordings, those fitted first.
        terms: Worth of each term; none if not asked for.
        remarks: Sentences on joints whose torques the start hardly explains, or whose links lag and
            offset alone predict better.
    """

    robot: Robot
    bandwidth: float
    parameters: tuple[MotionParameter, ...]
    fit: MotionFit
    chosen: np.ndarray
    residuals: tuple[RecordingResiduals, ...]
    terms: tuple[TermLeftOut, ...]
    remarks: tuple[str, ...]

    @property
    def identified(self) -> set[str]:
        """Names of the parameters that are identified."""
        return {p.name for p, own in zip(self.parameters, self.chosen, strict=True) if own}

    @property
    def refusal(self) -> str:
        """Why no robot should be written, in words; "" where one may be."""
        if not self.chosen.any():
            return "nothing is identified"
        fitted = [one for one in self.residuals if not one.held_out]
        left = np.max([one.torque for one in fitted], axis=0)
        lost = (left > _MORE_THAN_ALL) | np.any([one.misses_load for one in fitted], axis=0)
        if np.median(left) > 1.0 or lost.any():
            worst = int(np.where(lost.any() & ~lost, 0.0, left).argmax())
            return (
                f"the residual of the torque of motor {worst + 1} is {100.0 * left[worst]:.0f} % of"
                " it: are angles in rad, torques and angles of this and the neighbouring joints"
                " those at the gear's output, with the zero and the direction of the robot file?"
            )
        return ""

    @property
    def slow_error(self) -> np.ndarray:
        """Likely size of slow errors, of one period a turn [rad], (j,); nan without encoder."""
        found = np.full(len(self.robot.joints), np.nan)
        for p in self.fit.problem.parameters:
            if isinstance(p, SensorParameter) and p.harmonic == 1:
                found[p.joint] = p.prior * p.size
        return found

    @property
    def identified_robot(self) -> Robot:
        """The robot as written."""
        problem = replace(self.fit.problem, robot=self.robot)
        written = np.array([p.name in self.identified for p in problem.parameters])
        return problem.robot_at(np.where(written, self.fit.x, problem.start))


def identify_motion(
    robot: Robot,
    recordings: Sequence[Recording],
    held_out: Sequence[Recording],
    bandwidth: float,
    leave_out: bool,
) -> MotionIdentification:
    """Identify a robot from recordings of its motion.

    Args:
        robot: The start.
        recordings: Recordings that are fitted.
        held_out: Recordings that are predicted.
        bandwidth: Bandwidth of the motors' smoothed motion [Hz].
        leave_out: Whether every term is left out in turn, which the last recording held out judges.

    Raises:
        IdentifyError: If a joint is rigid, encoders differ, or nothing is to be fitted.
        SimulationError: If the start cannot be simulated along them.
    """
    _require_elastic(robot)
    with_link = recordings[0].with_link
    for recording in (*recordings, *held_out):
        if recording.with_link != with_link:
            got, needed = (_links(own) for own in (recording.with_link, with_link))
            raise IdentifyError(
                f"{recording.name}: expected the links' angles of {recordings[0].name}, {needed}, got"
                f" {got}: remove the columns that are not in both"
            )
    moved = tuple(MovedRecording.of(recording, bandwidth) for recording in recordings)
    others = tuple(MovedRecording.of(recording, bandwidth) for recording in held_out)
    parameters: tuple[MotionParameter, ...] = (
        *motion_parameters(robot, with_link),
        *sensor_parameters(with_link),
        *torque_parameters(robot),
    )
    if not parameters:
        raise IdentifyError(
            f"{robot.name}: expected drives or a payload in the robot file, or angles of links in the"
            " recording, got none: nothing can be identified"
        )
    unit = np.ones(len(robot.joints))
    with MovedRobot(robot) as fmu:
        problem = MotionProblem(fmu, robot, parameters, moved, unit, unit)
        remarks = [words for one in (*moved, *others) for words in _torque_remarks(problem, one)]
        bare = problem.without(np.array([p.vanishes for p in parameters]))
        first = fit_roughly(bare)
        lines = _lines(first)
        moved = tuple(replace(one, lines=lines) for one in moved)
        others = tuple(replace(one, lines=lines) for one in others)
        bare, problem = (replace(one, moved=moved) for one in (bare, problem))
        fit = first = select_backlashes(problem, fit_with_restarts(bare, first))
        for _ in range(_MOST_ITERATIONS):
            own = identifiable(fit) & ~(_drowned(fit) & (fit.problem.prior == 0.0))
            if own.all() and fit is not first:
                break
            fit = fit_motion(estimate_slow_errors(fit).only(own), fit.x[own], fit.slopes)
        identified = narrow(fit) & ~_drowned(fit)
        identified &= returns(
            fit, identified & np.array([p.of_gear for p in fit.problem.parameters])
        )
        names = {p.name for p, own in zip(fit.problem.parameters, identified, strict=True) if own}
        chosen = np.array([p.name in names for p in parameters])
        residuals = [residuals_of(fit.problem, one, fit.x, bandwidth, False) for one in moved]
        residuals += [residuals_of(fit.problem, one, fit.x, bandwidth, True) for one in others]
        terms = terms_left_out(fit, residuals[-1]) if leave_out and others else ()
    remarks += [words for one in residuals for words in remarks_on(one)]
    return MotionIdentification(
        robot, bandwidth, parameters, fit, chosen, tuple(residuals), terms, tuple(remarks)
    )


def _torque_remarks(problem: MotionProblem, moved: MovedRecording) -> tuple[str, ...]:
    """Return a sentence on each joint whose measured torque the start hardly explains."""
    torque, recording = problem.predicted(moved, problem.start).torque, moved.recording
    beside = MotorTorques(
        recording.name,
        range(torque.shape[1]),
        recording.time,
        recording.torque,
        torque,
        moved.motion.qd,
    )
    return torque_remarks(beside, problem.robot, IdentifyError)


def _links(joints: list[int]) -> str:
    return ", ".join(f"link[{i + 1}]" for i in joints) or "none"


def _require_elastic(robot: Robot) -> None:
    rigid = [j for j, joint in enumerate(robot.joints, start=1) if joint.stiffness is None]
    if rigid:
        raise IdentifyError(
            f"{robot.name}: expected a stiffness of every joint, got none of joint {rigid[0]}"
        )


def _drowned(fit: MotionFit) -> np.ndarray:
    """Return which numbers of gears do less than half of what is left of wind-ups, (P,) of bool.

    What is left follows no model; a stiffness that is fitted to it has an interval that is too narrow.
    """
    problem, gear, left = fit.problem, [], []
    for moved in problem.moved:
        predicted = problem.predicted(moved, fit.x)
        gear.append(predicted.shares["gear"])
        left.append(problem.left(moved, predicted)[0])
    small = np.std(np.vstack(gear), axis=0) < 0.5 * rms(np.vstack(left))
    own = [p.of_gear for p in problem.parameters]
    return np.array(own) & small[[p.joint for p in problem.parameters]]


def _lines(fit: MotionFit) -> tuple[tuple[float, ...], ...]:
    """Return the lines of every joint's encoder."""
    problem = fit.problem
    left = [problem.left(one, problem.predicted(one, fit.x))[0] for one in problem.moved]
    found: list[tuple[float, ...]] = [()] * len(problem.robot.joints)
    for i in problem.moved[0].recording.with_link:
        angles = [one.recording.link[:, i] for one in problem.moved]
        found[i] = encoder_lines([own[:, i] for own in left], angles)
    return tuple(found)
