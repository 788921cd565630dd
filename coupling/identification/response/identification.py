"""Stiffness and damping of a robot from frequency responses in several postures."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from coupling.errors import IdentifyError
from coupling.identification.response.cross_validation import posture_unlike_others
from coupling.identification.response.experiment import PostureResponse, ResponseExperiment
from coupling.identification.response.fit import ResponseFit, fit_responses
from coupling.identification.response.mismatch import (
    CHECKS,
    LARGEST_ERROR,
    LARGEST_IN_A_POSTURE,
    describe_mismatch,
)
from coupling.identification.response.robot_fit import (
    STIFFNESS,
    MeasuredPosture,
    RobotFit,
    log_error,
)
from coupling.identification.robot_file import entries_of, fitted_text, require_written
from coupling.identification.verdict import ParameterVerdict
from coupling.modes.hammer_test import is_hammer_test, read_measured
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

# A standard deviation above this part of the one before says that the measurement tells little.
_TOLD = 0.5
# Standard deviation of the log of a gear's stiffness that is fitted with what else gives way, over that
# of what the model does not describe: of 2, 3 and 4, 3 holds 89 % of 73 true values where links bend.
_BIAS = 3.0
# Half a 95 % interval of a normal distribution [standard deviations].
_QUANTILE = 1.96
# Log of the factor of a damping that the start file takes for zero.
_NONE = -20.0
# A robot is written that is better than the start by this factor at least.
_BETTER = 0.95
# Half of the springs are not further from the start's, but for a factor in common: the median is that of
# twice what is known of them (log).
_FAR_SPRINGS = 2.0 * 0.6745 * STIFFNESS
# One that predicts what is held out worse than the start by this factor is not.
_WORSE = 1.2


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
        IdentifyError: If a response is zero at a frequency.
    """
    responses = read_measured(file)
    for response in responses:
        if np.any(response.compliance == 0.0):
            hertz = response.frequency[np.argmax(response.compliance == 0.0)]
            raise IdentifyError(
                f"{file}: {response.name} at {hertz:g} Hz: expected a response other than zero, got 0:"
                " leave the row out, or the columns that were not measured"
            )
    return MeasuredPosture(file.name, q, responses, is_held_out)


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
    fitted = RobotFit.of(robot, torque_curve, measured)
    experiment, fit, postures = fitted.experiment, fitted.fit, fitted.postures
    damping = experiment.damping
    verdicts = _verdicts(robot, experiment, fit)
    start = np.array([verdict.start for verdict in verdicts])
    with np.errstate(divide="ignore"):
        logs = np.log(start / np.append(stiffness, damping))
    identified = np.array([verdict.identifiable for verdict in verdicts])
    kept = np.full(len(experiment.prior), np.nan)
    kept[: len(start)] = np.where(identified, np.nan, np.maximum(logs, _NONE))
    written = fit if identified.all() else fit_responses(experiment, kept, fit)
    values = np.where(identified, np.concatenate(experiment.parameters(written.x)), start)
    numbers = dict(zip((verdict.name for verdict in verdicts), values.tolist(), strict=True))
    changed = {v.name: numbers[v.name] for v in verdicts if v.identifiable}
    errors = [
        [log_error(posture, vector) for vector in (start, fitted.values, values)]
        for posture in postures
    ]
    overall = _median_errors(errors, [not each.is_held_out for each in measured])
    held_out = [each.is_held_out for each in measured]
    predicted = _median_errors(errors, held_out) if any(held_out) else None
    mismatches = _mismatches(measured, postures, errors, overall.written, experiment)
    mismatches += _far_springs(fit.x[: len(stiffness)])
    unlike = posture_unlike_others(robot, torque_curve, measured)
    result = ResponseFitResult(
        refusal=_refusal(changed, overall, predicted, [unlike, *mismatches]),
        converged=fit.estimate.converged,
        error=overall,
        residual=fit.residual,
        noise=fit.noise,
        held_out=predicted,
        parameters=tuple(verdict.result(numbers[verdict.name]) for verdict in verdicts),
        postures=tuple(
            _posture_result(posture, each, joints, values, error)
            for posture, each, joints, error in zip(
                postures, measured, fitted.unloaded, errors, strict=True
            )
        ),
    )
    return ResponseIdentification(robot, apply_values(robot, changed), verdicts, result)


def _verdicts(
    robot: Robot, experiment: ResponseExperiment, fit: ResponseFit
) -> tuple[ParameterVerdict[RobotParameter], ...]:
    """Return the verdicts on all stiffnesses, then on all dampings."""
    chain, parameters = build_chain(robot), Parameters.of(robot)
    gears = {int(row): gear for gear, row in enumerate(chain.torsions)}
    verdicts = []
    starts = np.append(parameters.stiffness, parameters.damping)
    values = np.concatenate(experiment.parameters(fit.x))
    for place, (value, log_sd) in enumerate(zip(values, fit.deviation, strict=False)):
        kind, row = (
            ("stiffness", "damping")[place // chain.elastic_count],
            place % chain.elastic_count,
        )
        name = f"{chain.elastic_names[row]}.{kind}"
        parameter = RobotParameter(name, kind, row, gears.get(row), float(starts[place]))
        bias = _BIAS * fit.discrepancy if kind == "stiffness" else 0.0
        spread = float(np.exp(_QUANTILE * np.hypot(log_sd, bias)))
        reason = ""
        if log_sd > _TOLD * experiment.prior[place]:
            reason = "these responses tell hardly more of it than is known without them"
        verdicts.append(
            ParameterVerdict(parameter, float(value), value / spread, value * spread, reason)
        )
    return tuple(verdicts)


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
    if mismatch := next(filter(None, mismatches), ""):
        return mismatch
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
    for response, off in zip(measured, np.split(log_errors, ends), strict=True):
        value = response.compliance * np.exp(off)
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
    require_written(result.refusal, target)
    values = {p.name: p.written for p in result.parameters if p.written is not None}
    entries = entries_of(identified.verdicts, values)
    fitted = [posture.name for posture in result.postures if not posture.held_out]
    words = (
        f"Median of |log(model / measurement)| {result.error.written:.3f}, of the start file"
        f" {result.error.start:.3f}."
    )
    source = f"frequency responses in {len(fitted)} postures: {', '.join(fitted)}"
    return fitted_text(start, identified.robot, entries, "identify", source, words, target)
