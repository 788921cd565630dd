"""Identification from motion as a whole: fit, and predict what was held out."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from typing import Any

import numpy as np

from coupling.errors import IdentifyError
from coupling.identification.motion.driven_fmu import DrivenFmu
from coupling.identification.motion.experiment import MotionExperiment
from coupling.identification.motion.fit import (
    estimate_slow_errors,
    fit_motion,
    fit_roughly,
    fit_with_restarts,
    identifiable,
    narrow,
    returns,
    select_backlashes,
)
from coupling.identification.motion.parameters import MotionParameter, motion_parameters
from coupling.identification.motion.problem import MotionProblem, SmoothedRecording, rms
from coupling.identification.motion.recording import Recording
from coupling.identification.motion.residuals import (
    misses_load,
    numbers,
    recording_result,
    remarks_on,
)
from coupling.identification.motion.sensors import (
    encoder_lines,
    sensor_parameters,
    torque_parameters,
)
from coupling.identification.motor_torques import MotorTorques, torque_remarks
from coupling.identification.robot_file import Identification
from coupling.results.motion_result import LinesResult, MotionResult, RecordingResult
from coupling.results.parameter_result import ParameterResult
from elastic_robot.description import Robot

# Fits at most, each of what the one before identifies.
_MOST_ITERATIONS = 4
# Part of a motor's torque that, left by a fit, shows that it is another joint's or in another unit [1].
_MORE_THAN_ALL = 1.03


def identify_motion(
    robot: Robot,
    recordings: Sequence[Recording],
    bandwidth: float,
) -> Identification[MotionExperiment, MotionResult]:
    """Identify a robot from recordings of its motion.

    Args:
        robot: The start.
        recordings: Recordings, one at least that is not held out.
        bandwidth: Bandwidth of the motors' smoothed motion [Hz].

    Returns:
        The fit of what is identifiable and of what is known before, figures, and the robot as written.

    Raises:
        IdentifyError: If a joint is rigid, encoders differ, or nothing is to be fitted.
        SimulationError: If the start cannot be simulated along them.
    """
    with_link = _require_alike(robot, recordings)
    is_held_out = [each.is_held_out for each in recordings]
    if all(is_held_out):
        raise IdentifyError("recordings: expected one to fit, got none but those held out")
    smoothed = [SmoothedRecording.of(each, bandwidth) for each in recordings]
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
    with DrivenFmu(robot) as fmu:
        problem = MotionProblem(fmu, robot, parameters, _fitted(smoothed))
        remarks = [words for each in smoothed for words in _torque_remarks(problem, each)]
        vanishing = np.array([p.vanishes for p in parameters])
        first = fit_roughly(problem.without(vanishing))
        lines = _lines(first)
        smoothed = [replace(each, lines=lines) for each in smoothed]
        problem = replace(problem, recordings=_fitted(smoothed))
        first = fit_with_restarts(problem.without(vanishing), first)
        fit = first = select_backlashes(problem, first)
        for _ in range(_MOST_ITERATIONS):
            is_chosen = identifiable(fit) & ~(_is_unexplained(fit) & (fit.problem.prior == 0.0))
            if is_chosen.all() and fit is not first:
                break
            fit = fit_motion(
                estimate_slow_errors(fit).only(is_chosen), fit.x[is_chosen], fit.slopes
            )
        verdicts = _judge(parameters, fit)
        results = [recording_result(fit.problem, each, fit.x, bandwidth) for each in smoothed]
    inertia = [joint.drive.inertia if joint.drive else 0.0 for joint in robot.joints]
    identified = {verdict.name for verdict in verdicts if verdict.identified}
    result = MotionResult(
        refusal=_refusal(smoothed, results) if identified else "nothing is identified",
        converged=fit.converged,
        bandwidth_Hz=bandwidth,
        noise_torque_Nm=tuple((smoothed[0].motion.noise * inertia).tolist()),
        blocks=len(fit.blocks.matrices),
        remarks=(*remarks, *(words for each in results for words in remarks_on(each))),
        joints=tuple(i + 1 for i in with_link),
        parameters=verdicts,
        recordings=tuple(results),
        lines=tuple(
            LinesResult(joint=i + 1, periods=periods) for i, periods in enumerate(lines) if periods
        ),
        slow_error_rad=_slow_errors(fit),
    )
    written = np.array([p.name in identified for p in fit.problem.parameters])
    problem = replace(fit.problem, robot=robot)
    identified_robot = problem.robot_at(np.where(written, fit.x, problem.start))
    return Identification(fit, identified_robot, result, "\n".join(map(_words, results)))


def _require_alike(robot: Robot, recordings: Sequence[Recording]) -> list[int]:
    """Return the joints whose links all recordings measure, of a robot without rigid joints."""
    rigid = [j for j, joint in enumerate(robot.joints, start=1) if joint.stiffness is None]
    if rigid:
        raise IdentifyError(
            f"{robot.name}: expected a stiffness of every joint, got none of joint {rigid[0]}"
        )
    first = recordings[0]
    for recording in recordings:
        if recording.with_link != first.with_link:
            got, needed = (
                ", ".join(f"link[{i + 1}]" for i in each.with_link) or "none"
                for each in (recording, first)
            )
            raise IdentifyError(
                f"{recording.name}: expected the links' angles of {first.name}, {needed}, got {got}:"
                " remove the columns that are not in both"
            )
    return first.with_link


def _judge(
    parameters: Sequence[MotionParameter], fit: MotionExperiment
) -> tuple[ParameterResult, ...]:
    """Return the verdicts on all parameters, but for those of slow errors, with the last fit."""
    is_narrow, is_unexplained = narrow(fit), _is_unexplained(fit)
    is_tried = is_narrow & ~is_unexplained & [p.of_gear for p in fit.problem.parameters]
    reasons = np.select(
        [is_unexplained, ~is_narrow, ~returns(fit, is_tried)],
        [
            "what no model explains is larger",
            "its interval is too wide",
            "other values fit as well",
        ],
        "",
    ).tolist()
    half = fit.blocks.half * fit.blocks.deviation
    ends = zip((fit.x - half).tolist(), (fit.x + half).tolist(), strict=True)
    rows = zip(fit.problem.parameters, fit.x.tolist(), ends, reasons, strict=True)
    fitted = {p.name: (p.outward(x), sorted(map(p.outward, e)), reason) for p, x, e, reason in rows}
    absent = np.nan, [np.nan, np.nan], "the recordings hardly depend on it"
    verdicts = []
    for p in parameters:
        if p.of_slow_error:
            continue
        of_fit = fitted.get(p.name, absent)
        further: dict[str, Any] = {"written": None} if p.sensor else {}
        verdicts.append(
            ParameterResult.judged(p.name, p.unit, p.value, *of_fit, term=p.term, **further)
        )
    return tuple(verdicts)


def _fitted(smoothed: Sequence[SmoothedRecording]) -> tuple[SmoothedRecording, ...]:
    return tuple(each for each in smoothed if not each.recording.is_held_out)


def _refusal(smoothed: Sequence[SmoothedRecording], results: Sequence[RecordingResult]) -> str:
    """Return why no robot should be written, by the recordings that were fitted; "" where one may be."""
    fitted = [pair for pair in zip(smoothed, results, strict=True) if not pair[1].held_out]
    parts = np.max([np.array(each.torque_relative, dtype=float) for _, each in fitted], axis=0)
    lost = [misses_load(*pair) for pair in fitted]
    is_lost = np.any(lost, axis=0) | (parts > _MORE_THAN_ALL)
    if not (np.median(parts) > 1.0 or is_lost.any()):
        return ""
    worst = int(np.where(is_lost.any() & ~is_lost, 0.0, parts).argmax())
    return (
        f"the residual of the torque of motor {worst + 1} is {100.0 * parts[worst]:.0f} % of"
        " it: are angles in rad, torques and angles of this and the neighbouring joints"
        " those at the gear's output, with the zero and the direction of the robot file?"
    )


def _slow_errors(fit: MotionExperiment) -> tuple[float | None, ...]:
    """Return the likely size of slow errors, of one period a turn [rad], (j,); None without encoder."""
    sizes = np.full(len(fit.problem.robot.joints), np.nan)
    for p in fit.problem.parameters:
        if p.harmonic == 1:
            sizes[p.joint] = p.prior * p.size
    return numbers(sizes)


def _words(recording: RecordingResult) -> str:
    """Return the residuals of a recording, as the head of a robot file says them."""
    words = "predicted" if recording.held_out else "fitted"
    links = ", ".join(f"{1e6 * size:.0f}" for size in recording.wind_up_rad if size is not None)
    torque = ", ".join(f"{100.0 * (part or 0.0):.0f}" for part in recording.torque_relative)
    link = f"motor less link {links} urad rms, " if links else ""
    return f"Residual of {recording.name}, {words}: {link}motor torque {torque} % of its rms."


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


def _wind_up_residuals(fit: MotionExperiment) -> list[np.ndarray]:
    """Return what is left of the wind-ups of all recordings [rad], (n, j) each."""
    pairs = zip(fit.problem.recordings, fit.predicted, strict=True)
    return [fit.problem.residuals(*pair)[0] for pair in pairs]


def _is_unexplained(fit: MotionExperiment) -> np.ndarray:
    """Return which numbers of gears do less than half of what is left of wind-ups, (P,) of bool.

    What is left follows no model; a stiffness that is fitted to it has an interval that is too narrow.
    """
    gear = np.vstack([predicted.shares["gear"] for predicted in fit.predicted])
    small = np.std(gear, axis=0) < 0.5 * rms(np.vstack(_wind_up_residuals(fit)))
    parameters = fit.problem.parameters
    return np.array([p.of_gear for p in parameters]) & small[[p.joint for p in parameters]]


def _lines(fit: MotionExperiment) -> tuple[tuple[float, ...], ...]:
    """Return the lines of every joint's encoder."""
    recordings, residuals = fit.problem.recordings, _wind_up_residuals(fit)
    lines: list[tuple[float, ...]] = [()] * len(fit.problem.robot.joints)
    for i in recordings[0].recording.with_link:
        angles = [smoothed.recording.link[:, i] for smoothed in recordings]
        lines[i] = encoder_lines([residual[:, i] for residual in residuals], angles)
    return tuple(lines)
