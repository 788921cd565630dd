"""What a motion has identified: figures in identified.json, and the robot file."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

import numpy as np

from coupling.identification.motion.identification import MotionIdentification
from coupling.identification.motion.residuals import RecordingResiduals
from coupling.identification.robot_file import fitted_text, require_written
from coupling.results.base import finite
from coupling.results.motion_result import (
    LinesResult,
    MotionResult,
    RecordingResult,
    WindUpShareResult,
)


def motion_figures(identification: MotionIdentification) -> MotionResult:
    """Return the figures of an identification; SI, None for what is infinite or not known."""
    first = identification.residuals[0]
    inertia = [joint.drive.inertia if joint.drive else 0.0 for joint in identification.robot.joints]
    return MotionResult(
        refusal=identification.refusal,
        converged=identification.fit.converged,
        bandwidth_Hz=identification.bandwidth,
        noise_torque_Nm=tuple((first.smoothed.motion.noise * inertia).tolist()),
        blocks=len(identification.fit.blocks.matrices),
        remarks=identification.remarks,
        joints=tuple(i + 1 for i in first.smoothed.recording.with_link),
        parameters=identification.parameters,
        recordings=tuple(_recording(residuals) for residuals in identification.residuals),
        lines=tuple(
            LinesResult(joint=i + 1, periods=periods)
            for i, periods in enumerate(first.smoothed.lines)
            if periods
        ),
        slow_error_rad=_all(identification.slow_error),
        terms=identification.terms,
    )


def _recording(residuals: RecordingResiduals) -> RecordingResult:
    recording = residuals.smoothed.recording
    linked = recording.with_link
    return RecordingResult(
        name=recording.name,
        held_out=residuals.held_out,
        time=tuple(recording.time.tolist()),
        rows=len(recording.time),
        wind_up_rad=_all(residuals.wind_up),
        wind_up_without_lines_rad=_all(residuals.without_lines),
        wind_up_lag_alone_rad=_all(residuals.lag_alone),
        torque_relative=_all(residuals.torque),
        slow_torque_relative=_all(residuals.slow_torque),
        measured_wind_up=_columns((recording.wind_up - recording.wind_up.mean(axis=0))[:, linked]),
        left_wind_up=_columns(residuals.left_wind_up[:, linked]),
        shares=tuple(
            WindUpShareResult(name=name, wind_up=_columns(wind_up - wind_up.mean(axis=0)))
            for name, wind_up in _shares(residuals).items()
        ),
        measured_torque=_columns(recording.torque),
        left_torque=_columns(recording.torque - residuals.predicted.torque),
    )


def _shares(residuals: RecordingResiduals) -> dict[str, np.ndarray]:
    """Return the causes of motor less link of joints with an encoder [rad], (n, l) each."""
    recording, linked = residuals.smoothed.recording, residuals.smoothed.recording.with_link
    shares = {name: wind_up[:, linked] for name, wind_up in residuals.predicted.shares.items()}
    lines = recording.wind_up - residuals.predicted.wind_up - residuals.left_wind_up
    if any(residuals.smoothed.lines):
        shares["lines of the encoder"] = lines[:, linked]
    return shares


def _columns(values: np.ndarray) -> tuple[tuple[float, ...], ...]:
    return tuple(tuple(np.round(column, 9).tolist()) for column in values.T)


def _all(values: np.ndarray | Sequence[float]) -> tuple[float | None, ...]:
    return tuple(map(finite, np.asarray(values).tolist()))


def motion_text(
    identification: MotionIdentification,
    figures: MotionResult,
    start: Path,
    target: Path,
    source: str,
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
    require_written(identification.refusal, target)
    parameters = [p for p in identification.parameters if p.written is not None]
    words = _residual_words(figures)
    return fitted_text(
        start, identification.identified_robot, parameters, "identify", source, words, target
    )


def _residual_words(figures: MotionResult) -> str:
    lines = []
    for recording in figures.recordings:
        words = "predicted" if recording.held_out else "fitted"
        links = ", ".join(
            f"{1e6 * value:.0f}" for value in recording.wind_up_rad if value is not None
        )
        torque = ", ".join(f"{100.0 * (value or 0.0):.0f}" for value in recording.torque_relative)
        link = f"motor less link {links} urad rms, " if links else ""
        lines.append(
            f"Residual of {recording.name}, {words}: {link}motor torque {torque} % of its rms."
        )
    return "\n".join(lines)
