"""What a motion has identified: figures in identified.json, and the robot file."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

import numpy as np

from coupling.errors import IdentifyError
from coupling.identification.motion.identification import MotionIdentification
from coupling.identification.motion.residuals import RecordingResiduals
from coupling.identification.motion.sensors import SensorParameter
from coupling.identification.robot_file import FileEntry, fitted_text
from coupling.identification.verdict import KEPT, interval_words
from coupling.results.base import finite
from coupling.results.motion_result import (
    LinesResult,
    MotionParameterResult,
    MotionResult,
    RecordingResult,
    TermResult,
    WindUpShareResult,
)


def motion_figures(found: MotionIdentification) -> MotionResult:
    """Return the figures of an identification; SI, None for what is infinite or not known."""
    first = found.residuals[0]
    inertia = [joint.drive.inertia if joint.drive else 0.0 for joint in found.robot.joints]
    return MotionResult(
        refusal=found.refusal,
        converged=found.fit.converged,
        bandwidth_Hz=found.bandwidth,
        noise_torque_Nm=tuple((first.moved.motion.noise * inertia).tolist()),
        blocks=len(found.fit.blocks.matrices),
        remarks=found.remarks,
        joints=tuple(i + 1 for i in first.moved.recording.with_link),
        parameters=tuple(_parameters(found)),
        recordings=tuple(_recording(one) for one in found.residuals),
        lines=tuple(
            LinesResult(joint=i + 1, periods=own) for i, own in enumerate(first.moved.lines) if own
        ),
        slow_error_rad=_all(found.slow_error),
        terms=tuple(
            TermResult(
                term=term.term,
                joint=term.joint + 1,
                wind_up_rad=(finite(term.wind_up[0]), finite(term.wind_up[1])),
                torque_relative=term.torque,
                likelier=finite(term.likelier),
            )
            for term in found.terms
        ),
    )


def _parameters(found: MotionIdentification) -> list[MotionParameterResult]:
    fit, rows = found.fit, []
    half = (fit.blocks.half * fit.blocks.deviation).tolist()
    fitted = {
        p.name: (x, h)
        for p, x, h in zip(fit.problem.parameters, fit.x.tolist(), half, strict=True)
        if p.name in found.identified
    }
    for p in found.parameters:
        if isinstance(p, SensorParameter) and p.of_slow_error:
            continue
        value = low = high = None
        if p.name in fitted:
            x, h = fitted[p.name]
            value = finite(p.outward(x))
            low, high = map(finite, sorted((p.outward(x - h), p.outward(x + h))))
        rows.append(
            MotionParameterResult(
                name=p.name,
                term=p.term,
                unit=p.unit,
                start=p.start,
                value=value,
                low=low,
                high=high,
                identified=p.name in fitted,
            )
        )
    return rows


def _recording(one: RecordingResiduals) -> RecordingResult:
    recording = one.moved.recording
    linked = recording.with_link
    return RecordingResult(
        name=recording.name,
        held_out=one.held_out,
        time=tuple(recording.time.tolist()),
        rows=len(recording.time),
        wind_up_rad=_all(one.wind_up),
        wind_up_without_lines_rad=_all(one.without_lines),
        wind_up_lag_alone_rad=_all(one.lag_alone),
        torque_relative=_all(one.torque),
        slow_torque_relative=_all(one.slow_torque),
        measured_wind_up=_columns((recording.wind_up - recording.wind_up.mean(axis=0))[:, linked]),
        left_wind_up=_columns(one.left_wind_up[:, linked]),
        shares=tuple(
            WindUpShareResult(name=name, wind_up=_columns(own - own.mean(axis=0)))
            for name, own in _shares(one).items()
        ),
        measured_torque=_columns(recording.torque),
        left_torque=_columns(recording.torque - one.predicted.torque),
    )


def _shares(one: RecordingResiduals) -> dict[str, np.ndarray]:
    """Return the causes of motor less link of joints with an encoder [rad], (n, l) each."""
    recording, linked = one.moved.recording, one.moved.recording.with_link
    shares = {name: own[:, linked] for name, own in one.predicted.shares.items()}
    lines = recording.wind_up - one.predicted.wind_up - one.left_wind_up
    if any(one.moved.lines):
        shares["lines of the encoder"] = lines[:, linked]
    return shares


def _columns(values: np.ndarray) -> tuple[tuple[float, ...], ...]:
    return tuple(tuple(np.round(column, 9).tolist()) for column in values.T)


def _all(values: np.ndarray | Sequence[float]) -> tuple[float | None, ...]:
    return tuple(map(finite, np.asarray(values).tolist()))


def moved_text(
    found: MotionIdentification, figures: MotionResult, start: Path, target: Path, source: str
) -> str:
    """Return the robot file with what was identified.

    Args:
        start: The start file.
        target: Path of the new one.
        source: Words on what was recorded, for [sources].

    Raises:
        IdentifyError: If the identification refuses to be written, or the file has another form.
        RobotFileError: If the start file cannot be read.
    """
    if found.refusal:
        raise IdentifyError(f"{target}: not written: {found.refusal}")
    of_robot = {p.name for p in found.parameters if not isinstance(p, SensorParameter)}
    entries = [
        FileEntry(
            result.name,
            result.value if result.identified else None,
            _remark(result),
            interval=(result.low, result.high),
        )
        for result in figures.parameters
        if result.name in of_robot
    ]
    left = _left(figures)
    return fitted_text(start, found.identified_robot, entries, "identify", source, left, target)


def _left(figures: MotionResult) -> str:
    lines = []
    for one in figures.recordings:
        words = "predicted" if one.held_out else "fitted"
        left = ", ".join(f"{1e6 * own:.0f}" for own in one.wind_up_rad if own is not None)
        torque = ", ".join(f"{100.0 * (own or 0.0):.0f}" for own in one.torque_relative)
        link = f"motor less link {left} urad rms, " if left else ""
        lines.append(f"Residual of {one.name}, {words}: {link}motor torque {torque} % of its rms.")
    return "\n".join(lines)


def _remark(result: MotionParameterResult) -> str:
    return interval_words(result.low, result.high) if result.identified else KEPT
