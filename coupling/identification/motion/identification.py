"""Identification from motion as a whole: fit, predict what was held out, leave terms out."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from coupling.errors import IdentifyError
from coupling.identification.motion.driven_fmu import DrivenFmu
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
from coupling.identification.motion.parameters import MotionParameter, motion_parameters
from coupling.identification.motion.problem import MotionProblem, SmoothedRecording
from coupling.identification.motion.recording import Recording
from coupling.identification.motion.residuals import (
    RecordingResiduals,
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
from coupling.results.base import finite
from coupling.results.motion_result import TermResult
from coupling.results.parameter_result import ParameterResult
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
        parameters: Verdict on each parameter, but for those of slow errors.
        fit: The fit of those that are identifiable, and of what is known before.
        residuals: Those of all recordings, those fitted first.
        terms: Worth of each term; none if not asked for.
        remarks: Sentences on joints whose torques the start hardly explains, or whose links lag and
            offset alone predict better.
    """

    robot: Robot
    bandwidth: float
    parameters: tuple[ParameterResult, ...]
    fit: MotionFit
    residuals: tuple[RecordingResiduals, ...]
    terms: tuple[TermResult, ...]
    remarks: tuple[str, ...]

    @property
    def identified(self) -> set[str]:
        """Names of the parameters that are identified."""
        return {verdict.name for verdict in self.parameters if verdict.identified}

    @property
    def refusal(self) -> str:
        """Why no robot should be written, in words; "" where one may be."""
        if not self.identified:
            return "nothing is identified"
        fitted = [recording for recording in self.residuals if not recording.held_out]
        parts = np.max([recording.torque for recording in fitted], axis=0)
        lost = (parts > _MORE_THAN_ALL) | np.any(
            [recording.misses_load for recording in fitted], axis=0
        )
        if np.median(parts) > 1.0 or lost.any():
            worst = int(np.where(lost.any() & ~lost, 0.0, parts).argmax())
            return (
                f"the residual of the torque of motor {worst + 1} is {100.0 * parts[worst]:.0f} % of"
                " it: are angles in rad, torques and angles of this and the neighbouring joints"
                " those at the gear's output, with the zero and the direction of the robot file?"
            )
        return ""

    @property
    def slow_error(self) -> np.ndarray:
        """Likely size of slow errors, of one period a turn [rad], (j,); nan without encoder."""
        sizes = np.full(len(self.robot.joints), np.nan)
        for p in self.fit.problem.parameters:
            if isinstance(p, SensorParameter) and p.harmonic == 1:
                sizes[p.joint] = p.prior * p.size
        return sizes

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
            got, needed = (_links(is_chosen) for is_chosen in (recording.with_link, with_link))
            raise IdentifyError(
                f"{recording.name}: expected the links' angles of {recordings[0].name}, {needed}, got"
                f" {got}: remove the columns that are not in both"
            )
    fitted = tuple(SmoothedRecording.of(recording, bandwidth) for recording in recordings)
    others = tuple(SmoothedRecording.of(recording, bandwidth) for recording in held_out)
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
    with DrivenFmu(robot) as fmu:
        problem = MotionProblem(fmu, robot, parameters, fitted, unit, unit)
        remarks = [
            words for smoothed in (*fitted, *others) for words in _torque_remarks(problem, smoothed)
        ]
        bare = problem.without(np.array([p.vanishes for p in parameters]))
        first = fit_roughly(bare)
        lines = _lines(first)
        fitted = tuple(replace(smoothed, lines=lines) for smoothed in fitted)
        others = tuple(replace(smoothed, lines=lines) for smoothed in others)
        bare, problem = (replace(smoothed, recordings=fitted) for smoothed in (bare, problem))
        fit = first = select_backlashes(problem, fit_with_restarts(bare, first))
        for _ in range(_MOST_ITERATIONS):
            is_chosen = identifiable(fit) & ~(_is_unexplained(fit) & (fit.problem.prior == 0.0))
            if is_chosen.all() and fit is not first:
                break
            fit = fit_motion(
                estimate_slow_errors(fit).only(is_chosen), fit.x[is_chosen], fit.slopes
            )
        verdicts = _judge(parameters, fit)
        residuals = [
            residuals_of(fit.problem, smoothed, fit.x, bandwidth, False) for smoothed in fitted
        ]
        residuals += [
            residuals_of(fit.problem, smoothed, fit.x, bandwidth, True) for smoothed in others
        ]
        terms = terms_left_out(fit, residuals[-1]) if leave_out and others else ()
    remarks += [words for smoothed in residuals for words in remarks_on(smoothed)]
    return MotionIdentification(
        robot, bandwidth, verdicts, fit, tuple(residuals), terms, tuple(remarks)
    )


def _judge(parameters: Sequence[MotionParameter], fit: MotionFit) -> tuple[ParameterResult, ...]:
    """Return the verdicts on all parameters, but for those of slow errors, with the last fit."""
    is_narrow, is_drowned = narrow(fit), _is_unexplained(fit)
    is_tried = is_narrow & ~is_drowned & [p.of_gear for p in fit.problem.parameters]
    reasons = np.select(
        [is_drowned, ~is_narrow, ~returns(fit, is_tried)],
        [
            "what no model explains is larger",
            "its interval is too wide",
            "other values fit as well",
        ],
        "",
    ).tolist()
    half = fit.blocks.half * fit.blocks.deviation
    ends = zip((fit.x - half).tolist(), (fit.x + half).tolist(), strict=True)
    numbers = zip(fit.problem.parameters, fit.x.tolist(), ends, reasons, strict=True)
    fitted = {
        p.name: (p.outward(x), sorted(map(p.outward, e)), reason) for p, x, e, reason in numbers
    }
    verdicts = []
    for p in parameters:
        if isinstance(p, SensorParameter) and p.of_slow_error:
            continue
        reason = "the recordings hardly depend on it"
        value, (low, high), reason = fitted.get(p.name, (np.nan, [np.nan, np.nan], reason))
        verdict = ParameterResult(
            name=p.name,
            unit=p.unit,
            start=finite(p.value),
            value=finite(value),
            low=finite(low),
            high=finite(high),
            written=None
            if isinstance(p, SensorParameter)
            else finite(p.value if reason else value),
            identified=not reason,
            reason=reason,
            term=p.term,
        )
        verdicts.append(verdict)
    return tuple(verdicts)


def _torque_remarks(problem: MotionProblem, smoothed: SmoothedRecording) -> tuple[str, ...]:
    """Return a sentence on each joint whose measured torque the start hardly explains."""
    torque, recording = problem.predicted(smoothed, problem.start).torque, smoothed.recording
    torques = MotorTorques(
        recording.name,
        range(torque.shape[1]),
        recording.time,
        recording.torque,
        torque,
        smoothed.motion.qd,
    )
    return torque_remarks(torques, problem.robot, IdentifyError)


def _links(joints: list[int]) -> str:
    return ", ".join(f"link[{i + 1}]" for i in joints) or "none"


def _require_elastic(robot: Robot) -> None:
    rigid = [j for j, joint in enumerate(robot.joints, start=1) if joint.stiffness is None]
    if rigid:
        raise IdentifyError(
            f"{robot.name}: expected a stiffness of every joint, got none of joint {rigid[0]}"
        )


def _is_unexplained(fit: MotionFit) -> np.ndarray:
    """Return which numbers of gears do less than half of what is left of wind-ups, (P,) of bool.

    What is left follows no model; a stiffness that is fitted to it has an interval that is too narrow.
    """
    problem, gear, residuals = fit.problem, [], []
    for smoothed in problem.recordings:
        predicted = problem.predicted(smoothed, fit.x)
        gear.append(predicted.shares["gear"])
        residuals.append(problem.residuals(smoothed, predicted)[0])
    small = np.std(np.vstack(gear), axis=0) < 0.5 * rms(np.vstack(residuals))
    of_gear = [p.of_gear for p in problem.parameters]
    return np.array(of_gear) & small[[p.joint for p in problem.parameters]]


def _lines(fit: MotionFit) -> tuple[tuple[float, ...], ...]:
    """Return the lines of every joint's encoder."""
    problem = fit.problem
    residuals = [
        problem.residuals(smoothed, problem.predicted(smoothed, fit.x))[0]
        for smoothed in problem.recordings
    ]
    lines: list[tuple[float, ...]] = [()] * len(problem.robot.joints)
    for i in problem.recordings[0].recording.with_link:
        angles = [smoothed.recording.link[:, i] for smoothed in problem.recordings]
        lines[i] = encoder_lines([residual[:, i] for residual in residuals], angles)
    return tuple(lines)
