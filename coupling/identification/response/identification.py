"""Stiffness and damping of a robot from frequency responses in several postures."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from coupling.errors import IdentifyError
from coupling.files.modal_damping import with_damping_ratio
from coupling.identification.response.experiment import DELAY, PostureResponse, ResponseExperiment
from coupling.identification.response.fit import ResponseFit, fit_responses
from coupling.identification.response.mismatch import (
    CHECKS,
    LARGEST_ERROR,
    LARGEST_IN_A_POSTURE,
    describe_mismatch,
)
from coupling.identification.robot_file import FileEntry, fitted_text
from coupling.identification.verdict import ParameterVerdict
from coupling.modes.hammer_test import is_hammer_test, read_measured
from coupling.modes.locked_robot import LockedRobot
from coupling.modes.measured_response import MeasuredResponse, is_of_responses, within
from coupling.results.modes_result import ResponseResult
from coupling.results.response_result import (
    LogErrorResult,
    PostureResponseResult,
    ResponseFitResult,
)
from coupling.robot.parameters import RobotParameter, apply_values
from elastic_robot.chain import build_chain
from elastic_robot.description import Robot
from elastic_robot.parameters import Parameters

# Standard deviations of the logs that are known before: a data sheet's or a class's stiffness, and a
# damping ratio of 0.04, which measured robots have within a factor of 2 to 3 [1].
_STIFFNESS, _DAMPING, _RATIO = 0.4, 1.0, 0.04
# Likewise of the instruments: log of the factor of their calibration [1], and delay of filters [s].
_FACTOR, _DELAY = 0.03, 3e-4
# What is taken off an error as theirs, at most [standard deviations].
_INSTRUMENTS = 3.0
# A standard deviation above this part of the one before says that the measurement tells little.
_TOLD = 0.5
# Half a 95 % interval of a normal distribution [standard deviations].
_QUANTILE = 1.96
# Times that the robot is linearised: under its weight it rests elsewhere with other springs.
_LINEARISED = 3
# Log of the factor of a damping that the start file takes for zero.
_NONE = -20.0
# A robot is written that is better than the start by this factor at least.
_BETTER = 0.95
# Half of the springs are not further from the start's, but for a factor in common: the median is that of
# twice what is known of them (log).
_FAR_SPRINGS = 2.0 * 0.6745 * _STIFFNESS
# One that predicts what is held out worse than the start by this factor is not.
_WORSE = 1.2


@dataclass(frozen=True)
class MeasuredPosture:
    """Frequency responses in a posture.

    Attributes:
        name: Name of the file.
        q: Angles of the drives [rad], (joints,).
        responses: The responses.
        is_held_out: Whether they are predicted, not fitted.
    """

    name: str
    q: np.ndarray
    responses: tuple[MeasuredResponse, ...]
    is_held_out: bool = False


@dataclass(frozen=True)
class ResponseIdentification:
    """What frequency responses have identified.

    Attributes:
        start: The robot of the start file.
        robot: The robot with what is written.
        verdicts: Verdicts on stiffness and damping.
        result: Figures.
    """

    start: Robot
    robot: Robot
    verdicts: tuple[ParameterVerdict[RobotParameter], ...]
    result: ResponseFitResult


def is_response(file: Path) -> bool:
    """Return whether a file is one of frequency responses or of a hammer test."""
    return is_of_responses(file) or is_hammer_test(file)


def read_posture(file: Path, q: np.ndarray, is_held_out: bool = False) -> MeasuredPosture:
    """Read the frequency responses or the hammer test of a posture.

    Args:
        q: Angles of the drives [rad], (joints,).

    Raises:
        StabilityError: If the file cannot be read, or has none.
    """
    return MeasuredPosture(file.name, q, read_measured(file), is_held_out)


def identify_from_responses(
    robot: Robot, torque_curve: str, measured: Sequence[MeasuredPosture]
) -> ResponseIdentification:
    """Identify stiffness and damping of all gears and tilts.

    Args:
        robot: The start.
        torque_curve: A name of `TORQUE_CURVES`; gears are on the flank that gravity presses them to.
        measured: Postures with their responses, one at least that is not held out.

    Raises:
        IdentifyError: If nothing gives way, or nothing is to be fitted.
        StabilityError: If the robot has no equilibrium in a posture.
    """
    stiffness = Parameters.of(robot).stiffness
    if not len(stiffness):
        raise IdentifyError(f"robot {robot.name}: expected joints that give way, got none")
    if all(posture.is_held_out for posture in measured):
        raise IdentifyError("measurements: expected responses to fit, got none but those held out")
    damping = Parameters.of(with_damping_ratio(robot, _RATIO)).damping
    instruments = np.tile([_FACTOR, _DELAY / DELAY], sum(not each.is_held_out for each in measured))
    prior = np.append(np.repeat([_STIFFNESS, _DAMPING], len(stiffness)), instruments)
    around = robot
    fit: ResponseFit | None = None
    for _ in range(_LINEARISED):
        postures, unloaded = _linearise(around, torque_curve, measured)
        fitted = tuple(
            p for p, each in zip(postures, measured, strict=True) if not each.is_held_out
        )
        experiment = ResponseExperiment(fitted, stiffness, damping, prior, 1.0)
        fit = fit_responses(experiment, np.full(len(prior), np.nan), fit)
        names = build_chain(robot).elastic_names
        springs = experiment.parameters(fit.x)[0].tolist()
        around = apply_values(
            robot, {f"{name}.stiffness": k for name, k in zip(names, springs, strict=True)}
        )
    assert fit is not None
    verdicts = _verdicts(robot, experiment, fit)
    start = np.array([verdict.start for verdict in verdicts])
    with np.errstate(divide="ignore"):
        logs = np.log(start / np.append(stiffness, damping))
    identified = np.array([verdict.identifiable for verdict in verdicts])
    kept = np.full(len(prior), np.nan)
    kept[: len(start)] = np.where(identified, np.nan, np.maximum(logs, _NONE))
    written = fit if identified.all() else fit_responses(experiment, kept, fit)
    fitted_values = _values(experiment, fit)
    values = np.where(identified, _values(experiment, written), start)
    numbers = dict(zip((verdict.name for verdict in verdicts), values.tolist(), strict=True))
    changed = {v.name: numbers[v.name] for v in verdicts if v.identifiable}
    errors = [
        [_residual(posture, vector) for vector in (start, fitted_values, values)]
        for posture in postures
    ]
    overall = _median_errors(errors, [not each.is_held_out for each in measured])
    held_out = [each.is_held_out for each in measured]
    predicted = _median_errors(errors, held_out) if any(held_out) else None
    mismatches = _mismatches(measured, postures, errors, overall.written, experiment)
    mismatches += _far_springs(fit.x[: len(stiffness)])
    result = ResponseFitResult(
        refusal=_refusal(changed, overall, predicted, mismatches),
        converged=fit.estimate.converged,
        error=overall,
        residual=fit.residual,
        noise=fit.noise,
        held_out=predicted,
        parameters=tuple(verdict.result(numbers[verdict.name]) for verdict in verdicts),
        postures=tuple(
            _posture_result(posture, each, joints, values, error)
            for posture, each, joints, error in zip(
                postures, measured, unloaded, errors, strict=True
            )
        ),
    )
    return ResponseIdentification(robot, apply_values(robot, changed), verdicts, result)


def _linearise(
    robot: Robot, torque_curve: str, measured: Sequence[MeasuredPosture]
) -> tuple[list[PostureResponse], list[tuple[int, ...]]]:
    """Return the robot in all postures, and the joints whose gears are unloaded there."""
    locked, stiffness = LockedRobot(robot, torque_curve), Parameters.of(robot).stiffness
    postures, unloaded = [], []
    for each in measured:
        linear = locked.linear(each.q, np.zeros(6))
        postures.append(PostureResponse.of(linear, stiffness, each.responses))
        unloaded.append(locked.unloaded_joints(linear))
    return postures, unloaded


def _values(experiment: ResponseExperiment, fit: ResponseFit) -> np.ndarray:
    return np.concatenate(experiment.parameters(fit.x))


def _verdicts(
    robot: Robot, experiment: ResponseExperiment, fit: ResponseFit
) -> tuple[ParameterVerdict[RobotParameter], ...]:
    """Return the verdicts on all stiffnesses, then on all dampings."""
    chain, parameters = build_chain(robot), Parameters.of(robot)
    gears = {int(row): gear for gear, row in enumerate(chain.torsions)}
    verdicts = []
    starts = np.append(parameters.stiffness, parameters.damping)
    values = _values(experiment, fit)
    for place, (value, log_sd) in enumerate(zip(values, fit.deviation, strict=False)):
        kind, row = (
            ("stiffness", "damping")[place // chain.elastic_count],
            place % chain.elastic_count,
        )
        name = f"{chain.elastic_names[row]}.{kind}"
        parameter = RobotParameter(name, kind, row, gears.get(row), float(starts[place]))
        spread = float(np.exp(_QUANTILE * log_sd))
        reason = ""
        if log_sd > _TOLD * experiment.prior[place]:
            reason = "these responses tell hardly more of it than is known without them"
        verdicts.append(
            ParameterVerdict(parameter, float(value), value / spread, value * spread, reason)
        )
    return tuple(verdicts)


def _residual(posture: PostureResponse, values: np.ndarray) -> np.ndarray:
    """Return log of model over measurement [1], complex, (n,), but for a factor and a delay."""
    residual = posture.log_residual(*np.split(values, 2))[0]
    factor, delay = posture.by_instrument.T
    log_factor = np.clip(np.median(residual.real), -_INSTRUMENTS * _FACTOR, _INSTRUMENTS * _FACTOR)
    late = np.median(residual.imag / delay.imag)
    late = np.clip(late, -_INSTRUMENTS * _DELAY / DELAY, _INSTRUMENTS * _DELAY / DELAY)
    return residual + log_factor * factor - late * delay


def _median_errors(
    errors: Sequence[Sequence[np.ndarray]], chosen: Sequence[bool]
) -> LogErrorResult:
    """Return the median sizes of the residuals of start, fit and written file in chosen postures."""
    start, fit, written = (
        float(np.median(np.abs(np.concatenate(parts))))
        for parts in zip(
            *(e for e, is_chosen in zip(errors, chosen, strict=True) if is_chosen), strict=True
        )
    )
    return LogErrorResult(start=start, fit=fit, written=written)


def _mismatches(
    measured: Sequence[MeasuredPosture],
    postures: Sequence[PostureResponse],
    errors: Sequence[Sequence[np.ndarray]],
    overall: float,
    experiment: ResponseExperiment,
) -> list[str]:
    """Return in words which file cannot be of its posture, the worst; none if all can."""
    sizes = [float(np.median(np.abs(written))) for _, _, written in errors]
    worst = int(np.argmax(sizes))
    if overall <= LARGEST_ERROR and sizes[worst] <= LARGEST_IN_A_POSTURE:
        return []
    others = [
        (each.name, posture)
        for k, (each, posture) in enumerate(zip(measured, postures, strict=True))
        if k != worst
    ]
    name = measured[worst].name
    return [describe_mismatch(name, sizes[worst], postures[worst], others, experiment)]


def _far_springs(log_factors: np.ndarray) -> list[str]:
    """Return in words why springs cannot be those of a robot like the start file's; none if they can.

    Args:
        log_factors: Logs of fitted over start stiffness [1], (m,).
    """
    off = np.median(np.abs(log_factors - np.median(log_factors)))
    if off <= _FAR_SPRINGS:
        return []
    return [
        f"half of the springs would have to change by a factor of {np.exp(off):.2g} or more against the"
        f" others (expected {np.exp(_FAR_SPRINGS):.2g} at most): {CHECKS}, and measure more directions"
        " and postures, which wrong springs cannot all explain"
    ]


def _refusal(
    changed: dict[str, float],
    error: LogErrorResult,
    predicted: LogErrorResult | None,
    mismatches: Sequence[str],
) -> str:
    if mismatches:
        return mismatches[0]
    if not changed:
        return "the responses identify neither a stiffness nor a damping"
    if error.written > _BETTER * error.start:
        return (
            "the robot would be no better than the start file, log(model / measurement)"
            f" {error.written:.3g} after {error.start:.3g}: {CHECKS}"
        )
    if predicted is not None and predicted.written > _WORSE * predicted.start:
        return (
            "the robot would predict the responses that are held out worse than the start file does,"
            f" log(model / measurement) {predicted.written:.3g} after {predicted.start:.3g}: measure in"
            " more postures, and check that all files are of one robot, tool and payload"
        )
    return ""


def _posture_result(
    posture: PostureResponse,
    measured: MeasuredPosture,
    unloaded: tuple[int, ...],
    values: np.ndarray,
    errors: Sequence[np.ndarray],
) -> PostureResponseResult:
    low, high = within(measured.responses)
    start, fit, written = (float(np.median(np.abs(error))) for error in errors)
    frequency, ratio = posture.modes(*np.split(values, 2))
    return PostureResponseResult(
        name=measured.name,
        posture_deg=tuple(np.rad2deg(measured.q).tolist()),
        held_out=measured.is_held_out,
        unloaded_joints=unloaded,
        lowest_Hz=low,
        highest_Hz=high,
        error=LogErrorResult(start=start, fit=fit, written=written),
        modes_Hz=tuple(frequency.tolist()),
        damping_ratios=tuple(ratio.tolist()),
        measured=_responses(posture.in_order, np.zeros(len(errors[0]))),
        start=_responses(posture.in_order, errors[0]),
        written=_responses(posture.in_order, errors[2]),
    )


def _responses(
    measured: Sequence[MeasuredResponse], log_errors: np.ndarray
) -> tuple[ResponseResult, ...]:
    """Return responses that are off the measured ones by logs [1], complex, (n,)."""
    ends = np.cumsum([len(response.frequency) for response in measured])[:-1]
    results = []
    for response, log_error in zip(measured, np.split(log_errors, ends), strict=True):
        value = response.compliance * np.exp(log_error)
        results.append(
            ResponseResult(
                name=response.name,
                frequency_Hz=tuple(response.frequency.tolist()),
                real_m_N=tuple(value.real.tolist()),
                imag_m_N=tuple(value.imag.tolist()),
            )
        )
    return tuple(results)


def responses_text(identified: ResponseIdentification, start: Path, target: Path) -> str:
    """Return the robot file with the identified values.

    Args:
        start: The start file.
        target: Path of the new one.

    Raises:
        IdentifyError: If it is refused.
        RobotFileError: If the start file cannot be read.
    """
    result = identified.result
    if result.refusal:
        raise IdentifyError(f"{target}: not written: {result.refusal}")
    written = {parameter.name: parameter.written for parameter in result.parameters}
    entries = [
        FileEntry(
            verdict.name,
            written[verdict.name] if verdict.identifiable else None,
            verdict.remark,
            interval=(verdict.low, verdict.high),
        )
        for verdict in identified.verdicts
    ]
    fitted = [posture.name for posture in result.postures if not posture.held_out]
    words = (
        f"Median of |log(model / measurement)| {result.error.written:.3f}, of the start file"
        f" {result.error.start:.3f}."
    )
    source = f"frequency responses in {len(fitted)} postures: {', '.join(fitted)}"
    return fitted_text(start, identified.robot, entries, "identify", source, words, target)
