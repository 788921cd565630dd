"""The report of an identification from motion: figures, parameters, what is left over time."""

from __future__ import annotations

import numpy as np
import plotly.graph_objects as go

from coupling.errors import sentence
from coupling.report.colours import AFTER, BEFORE, DESIRED, GREEN, PLANT
from coupling.report.document import document
from coupling.report.section import Note, Section, Table
from coupling.report.style import UM, DrawnLine, over_time
from coupling.results.motion_result import MotionParameterResult, MotionResult, RecordingResult


def motion_page(title: str, found: MotionResult) -> str:
    """Return the page of an identification from motion as one self-contained HTML text.

    Args:
        title: Title of the page.
        found: Its figures, the content of identified.json.
    """
    sections = motion_summary(found)
    for one in found.recordings:
        words = "predicted" if one.held_out else "fitted"
        if found.joints:
            figures = [wind_up_figure(found, one, k) for k in range(len(found.joints))]
            name = f"wind-up-{one.name}"
            title_ = f"{one.name}, {words}: motor less link"
            sections.append(Section(title_, [_WIND_UP], name, figures))
            shares = [share_figure(found, one, k) for k in range(len(found.joints))]
            sections.append(Section("By cause, without the lag", [], f"causes-{one.name}", shares))
        torques = [torque_figure(one, k) for k in range(len(one.measured_torque))]
        sections.append(
            Section(f"{one.name}, {words}: motor torque", [], f"torque-{one.name}", torques)
        )
    return document(title, sections)


def motion_summary(found: MotionResult) -> list[Section]:
    """Return what was identified from motion."""
    good = not found.refusal
    words = sentence(f"NOT WRITTEN: {found.refusal}") if found.refusal else "Identified."
    if not found.converged:
        words += " The fit has not converged: its values may still change."
    noise = max(found.noise_torque_Nm)
    remark = (
        f"The motors' angles are low-passed at {found.bandwidth_Hz:g} Hz; the noise of their encoders"
        f" then causes at most {noise:.2g} N m of rotor torque. Intervals from {found.blocks} blocks"
        " of time."
    )
    sections = [
        Section("", [words, *found.remarks], good=good and not found.remarks),
        Section("", [_sizes(found), remark]),
        Section("Parameters", [_parameters(found)]),
    ]
    if found.lines:
        lines = [
            f"Encoder of link {own.joint}: {', '.join(f'{n:g}' for n in own.periods)} periods per turn."
            for own in found.lines
        ]
        sections.append(Section("Periodic errors of encoders", [*lines, _LINES]))
    slow = [f"{UM * own:.0f}" for own in found.slow_error_rad if own is not None]
    if slow:
        words = f"Estimated size of one period per turn: {', '.join(slow)} urad."
        sections.append(Section("Slow errors of encoders", [words, _SLOW]))
    if found.terms:
        sections.append(Section("Without each term", [_terms(found), _TERMS]))
    return sections


def _sizes(found: MotionResult) -> Table:
    rows = []
    for one in found.recordings:
        words = "predicted" if one.held_out else "fitted"
        for text, factor, values in (
            ("motor less link [urad]", UM, one.wind_up_rad),
            ("- without the encoder's periodic errors", UM, one.wind_up_without_lines_rad),
            ("- with lag, offset and periodic errors alone", UM, one.wind_up_lag_alone_rad),
            ("motor torque [% of its rms]", 100.0, one.torque_relative),
            (f"- below {found.bandwidth_Hz:g} Hz", 100.0, one.slow_torque_relative),
        ):
            if any(value is not None for value in values):
                rows.append((one.name, words, text, *(_size(v, factor) for v in values)))
    joints = [f"joint {i + 1}" for i in range(len(found.recordings[0].wind_up_rad))]
    return Table(("recording", "", "rms residual of", *joints), rows)


def _size(value: float | None, factor: float) -> str:
    return "" if value is None else f"{factor * value:.3g}"


def _parameters(found: MotionResult) -> Table:
    return Table(
        ("parameter", "start", "fit", "95 % from", "to", "unit"),
        [_row(p) for p in found.parameters],
    )


def _row(own: MotionParameterResult) -> tuple[str, ...]:
    if not own.identified:
        return own.name, f"{own.start:.4g}", "kept, not identifiable", "", "", own.unit
    values = ("∞" if v is None else f"{v:.4g}" for v in (own.value, own.low, own.high))
    return own.name, f"{own.start:.4g}", *values, own.unit


def _terms(found: MotionResult) -> Table:
    rows = [
        (
            own.term,
            *(_size(value, UM) for value in own.wind_up_rad),
            *(_size(value, 100.0) for value in own.torque_relative),
            _size(own.likelier, 1.0),
        )
        for own in found.terms
    ]
    columns = ("left out", "with [urad]", "without", "with [%]", "without", "likelier by e^")
    groups = (("", 1), ("motor less link", 2), ("motor torque", 2), ("fitted", 1))
    return Table(columns, rows, groups=groups)


def wind_up_figure(found: MotionResult, one: RecordingResult, k: int) -> go.Figure:
    """Draw motor less link of an encoder over time: measured, predicted, what is left."""
    measured = UM * np.array(one.measured_wind_up[k])
    left = UM * np.array(one.left_wind_up[k])
    return _beside(one, measured, left, f"joint {found.joints[k]} [urad]")


def share_figure(found: MotionResult, one: RecordingResult, k: int) -> go.Figure:
    """Draw an encoder's motor less link without its lag over time, and what makes it."""
    shares = {own.name: UM * np.array(own.wind_up[k]) for own in one.shares}
    measured = UM * np.array(one.measured_wind_up[k]) - shares.pop("lag", 0.0)
    curves = {"measured": measured, **shares}.items()
    colours = (DESIRED, AFTER, BEFORE, GREEN, PLANT)
    lines = [
        DrawnLine(words, color, one.time, values, 1.2)
        for (words, values), color in zip(curves, colours, strict=False)
    ]
    return over_time(lines, f"joint {found.joints[k]} [urad]", 300)


def torque_figure(one: RecordingResult, k: int) -> go.Figure:
    """Draw the torque of a motor over time: measured, predicted, what is left."""
    measured, left = np.array(one.measured_torque[k]), np.array(one.left_torque[k])
    return _beside(one, measured, left, f"joint {k + 1} [N m]")


def _beside(one: RecordingResult, measured: np.ndarray, left: np.ndarray, label: str) -> go.Figure:
    """Draw what was measured, what is predicted and what is left, (k,) each in the label's unit."""
    lines = [
        DrawnLine("measured", DESIRED, one.time, measured, 1.0),
        DrawnLine("predicted", AFTER, one.time, measured - left),
        DrawnLine("residual", BEFORE, one.time, left, 1.0),
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
_TERMS = Note(
    "Residual of the last held-out recording at the term's joint, with the term and without it; the"
    " other parameters respond to first order. Without a stiffness, rotor or payload: its start"
    " value; without another term: zero. Last column: logarithm of the likelihood ratio of the"
    " fitted recordings, with to without the term; below 2 they do not support it."
)
