"""The report of what was learned: what is left of the measurement, parameters, gears."""

from __future__ import annotations

import numpy as np
import plotly.graph_objects as go

from coupling.errors import sentence
from coupling.report.colours import AFTER, BEFORE, DESIRED
from coupling.report.document import document
from coupling.report.intervals import ShownInterval, interval_figure
from coupling.report.run_tables import gear_loads
from coupling.report.section import Note, Section, Table, warned
from coupling.report.style import UM, DrawnLine, over_time, rule
from coupling.results.learned_result import LearnedResult, LearnedRunResult


def learn_page(title: str, found: LearnedResult) -> str:
    """Return the page of what was learned as one self-contained HTML text.

    Args:
        title: Title of the page.
        found: Its figures, the content of learned.json.
    """
    left = [
        Section(f"Residual: {one.measured}", [_left_note(found)], f"left{number}", [_left(one)])
        for number, one in enumerate(found.runs)
    ]
    intervals = Section("Intervals", [_INTERVALS], "intervals", [_intervals(found)])
    return document(title, [*learn_summary(found), *left, intervals])


def learn_summary(found: LearnedResult) -> list[Section]:
    """Return what was learned."""
    count = sum(own.identifiable for own in found.parameters)
    words = (
        sentence(f"NOT WRITTEN: {found.refusal}")
        if found.refusal
        else f"Learned: {count} of {len(found.parameters)} parameters are identifiable."
    )
    return [
        Section("", [words], good=not found.refusal),
        *warned(map(sentence, found.warnings)),
        Section("", _sizes(found)),
        Section("Parameters", [_parameters(found)]),
        *gear_loads(found.gears),
    ]


def _sizes(found: LearnedResult) -> list[Table]:
    left = found.left_m
    rows = [
        ("residual, robot file", f"{UM * left.robot_file:.1f}"),
        ("residual, learned robot", f"{UM * left.learned:.1f}"),
        ("noise alone", f"{UM * found.noise_left_m:.1f}"),
    ]
    frames = [
        (
            one.measured,
            one.run,
            f"{one.rows}",
            f"{one.from_s:.2f} to {one.to_s:.2f}",
            ", ".join(f"{round(UM * value) + 0}" for value in one.frame_shift_m),
            ", ".join(f"{1e3 * value:.2f}" for value in one.frame_turn_rad),
            f"{1e3 * one.clock_s:+.1f}",
        )
        for one in found.runs
    ]
    columns = (
        *("measurement", "run", "rows", "time of the run [s]"),
        *("offset of frame [um]", "and [mrad]", "offset of clock [ms]"),
    )
    slow = (f"deviation below {found.slow_below_Hz:g} Hz", "rms [um]")
    return [Table(slow, rows), Table(columns, frames)]


def _parameters(found: LearnedResult) -> Table:
    rows = [
        (
            own.name,
            *(f"{value:.4g}" for value in (own.start, own.value, own.low, own.high)),
            "kept" if own.written == own.start else f"{own.written:.4g}",
            f"{UM * own.effect_m:.2g}",
            own.reason,
        )
        for own in found.parameters
    ]
    columns = (
        "parameter",
        "file",
        "found",
        "95 % from",
        "to",
        "written",
        "effect at the tool [um]",
        "",
    )
    return Table(columns, rows)


def _left(one: LearnedRunResult) -> go.Figure:
    lines = [
        DrawnLine("robot file", BEFORE, one.time, UM * np.array(one.left_robot_file_m)),
        DrawnLine("learned robot", AFTER, one.time, UM * np.array(one.left_learned_m)),
    ]
    return over_time(lines, "distance [um]", 360, "time of the run [s]", {"rangemode": "tozero"})


def _intervals(found: LearnedResult) -> go.Figure:
    rows = [
        ShownInterval(own.name, own.factor, own.factor_low, own.factor_high, own.identifiable)
        for own in found.parameters
    ]
    return interval_figure(
        rows,
        ("identifiable, 95 % interval", "not identifiable"),
        24,
        {"title": "factor of the robot file's value"},
        shapes=[rule("x", 1.0, color=DESIRED, width=1)],
    )


def _left_note(found: LearnedResult) -> Note:
    return Note(
        "Distance between the measured and the simulated tool under the same command, below"
        f" {found.slow_below_Hz:g} Hz, with the measuring frame and clock that fit each robot best."
    )


_INTERVALS = Note(
    "Intervals of identifiable parameters are calibrated on simulated robots; the others are as wide as"
    " before the measurement."
)
