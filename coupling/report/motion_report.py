"""The report of an identification from motion: figures, parameters, what is left over time."""

from __future__ import annotations

import numpy as np
import plotly.graph_objects as go

from coupling.path.length_text import format_um
from coupling.report.colours import AFTER, BEFORE, DESIRED, GREEN, PLANT
from coupling.report.parameter_table import parameter_table
from coupling.report.style import DrawnLine, over_time
from coupling.results.motion_result import MotionResult, RecordingResult
from coupling.results.section import UM, Note, Section, Table


def _recordings(result: MotionResult) -> list[Section]:
    """Return what is left of all recordings over time."""
    sections = []
    for recording in result.recordings:
        words = "predicted" if recording.held_out else "fitted"
        if result.joints:
            figures = [wind_up_figure(result, recording, k) for k in range(len(result.joints))]
            name = f"wind-up-{recording.name}"
            title_ = f"{recording.name}, {words}: motor less link"
            sections.append(Section(title_, [_WIND_UP], name, figures))
            shares = [share_figure(result, recording, k) for k in range(len(result.joints))]
            sections.append(
                Section("By cause, without the lag", [], f"causes-{recording.name}", shares)
            )
        torques = [torque_figure(recording, k) for k in range(len(recording.measured_torque))]
        sections.append(
            Section(
                f"{recording.name}, {words}: motor torque", [], f"torque-{recording.name}", torques
            )
        )
    return sections


def motion_sections(result: MotionResult) -> list[Section]:
    """Return what was identified from motion."""
    noise = max(result.noise_torque_Nm)
    remark = (
        f"The motors' angles are low-passed at {result.bandwidth_Hz:g} Hz; the noise of their encoders"
        f" then causes at most {noise:.2g} N m of rotor torque. Intervals from {result.blocks} blocks"
        " of time."
    )
    sections = [
        Section("", [_sizes(result), remark]),
        Section("Parameters", [parameter_table(result.parameters)]),
    ]
    if result.lines:
        lines = [
            f"Encoder of link {line.joint}:"
            f" {', '.join(f'{n:g}' for n in line.periods)} periods per turn."
            for line in result.lines
        ]
        sections.append(Section("Periodic errors of encoders", [*lines, _LINES]))
    slow = [format_um(line) for line in result.slow_error_rad if line is not None]
    if slow:
        words = f"Estimated size of one period per turn: {', '.join(slow)} urad."
        sections.append(Section("Slow errors of encoders", [words, _SLOW]))
    return [*sections, *_recordings(result)]


def _sizes(result: MotionResult) -> Table:
    rows = []
    for recording in result.recordings:
        words = "predicted" if recording.held_out else "fitted"
        for text, factor, values in (
            ("motor less link [urad]", UM, recording.wind_up_rad),
            ("- without the encoder's periodic errors", UM, recording.wind_up_without_lines_rad),
            ("- with lag, offset and periodic errors alone", UM, recording.wind_up_lag_alone_rad),
            ("motor torque [% of its rms]", 100.0, recording.torque_relative),
            (f"- below {result.bandwidth_Hz:g} Hz", 100.0, recording.slow_torque_relative),
        ):
            if any(value is not None for value in values):
                rows.append((recording.name, words, text, *(_size(v, factor) for v in values)))
    joints = [f"joint {i + 1}" for i in range(len(result.recordings[0].wind_up_rad))]
    return Table(("recording", "", "rms residual of", *joints), rows)


def _size(value: float | None, factor: float) -> str:
    return "" if value is None else f"{factor * value:.3g}"


def wind_up_figure(result: MotionResult, recording: RecordingResult, k: int) -> go.Figure:
    """Draw motor less link of an encoder over time: measured, predicted, what is left."""
    measured = UM * np.array(recording.measured_wind_up[k])
    residual = UM * np.array(recording.left_wind_up[k])
    return _measured_and_residual(recording, measured, residual, f"joint {result.joints[k]} [urad]")


def share_figure(result: MotionResult, recording: RecordingResult, k: int) -> go.Figure:
    """Draw an encoder's motor less link without its lag over time, and what makes it."""
    shares = {share.name: UM * np.array(share.wind_up[k]) for share in recording.shares}
    measured = UM * np.array(recording.measured_wind_up[k]) - shares.pop("lag", 0.0)
    curves = {"measured": measured, **shares}.items()
    colours = (DESIRED, AFTER, BEFORE, GREEN, PLANT)
    lines = [
        DrawnLine(words, color, recording.time, values, 1.2)
        for (words, values), color in zip(curves, colours, strict=False)
    ]
    return over_time(lines, f"joint {result.joints[k]} [urad]", 300)


def torque_figure(recording: RecordingResult, k: int) -> go.Figure:
    """Draw the torque of a motor over time: measured, predicted, what is left."""
    measured, residual = np.array(recording.measured_torque[k]), np.array(recording.left_torque[k])
    return _measured_and_residual(recording, measured, residual, f"joint {k + 1} [N m]")


def _measured_and_residual(
    recording: RecordingResult, measured: np.ndarray, residual: np.ndarray, label: str
) -> go.Figure:
    """Draw what was measured, what is predicted and what is left, (k,) each in the label's unit."""
    lines = [
        DrawnLine("measured", DESIRED, recording.time, measured, 1.0),
        DrawnLine("predicted", AFTER, recording.time, measured - residual),
        DrawnLine("residual", BEFORE, recording.time, residual, 1.0),
    ]
    return over_time(lines, label, 300)


_WIND_UP = Note(
    "Predicted with lag, slow error and loop (hysteresis) of the encoders, and the recording's own"
    " offset and phases."
)
_LINES = Note("An incremental encoder starts at any angle: each recording has its own phases.")
_SLOW = Note(
    "Up to eight periods per turn, k periods with a k-th of the size; hardly determined at angles that"
    " the link did not reach."
)
