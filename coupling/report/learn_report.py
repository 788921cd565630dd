"""Sections on what was learned: what is left of the measurement, parameters, gears."""

from __future__ import annotations

import numpy as np
import plotly.graph_objects as go

from coupling.errors import sentence
from coupling.path.length_text import in_unit, length_unit
from coupling.report.colours import AFTER, BEFORE
from coupling.report.parameter_table import parameter_table
from coupling.report.style import DrawnLine, over_time
from coupling.results.learned_result import LearnedResult, LearnedRunResult
from coupling.results.section import UM, Note, Section, Table
from coupling.run.gear_check import gear_sections


def learned_figures(result: LearnedResult) -> list[Section]:
    """Return the figures of what was learned.

    Args:
        result: The content of learned.json.
    """
    return [
        Section(
            f"Residual: {run.measured}",
            [_left_note(result)],
            f"left{number}",
            [_residual_figure(run)],
        )
        for number, run in enumerate(result.runs)
    ]


def learned_summary(result: LearnedResult) -> list[Section]:
    """Return what was learned."""
    count = sum(parameter.identified for parameter in result.parameters)
    words = (
        sentence(f"NOT WRITTEN: {result.refusal}")
        if result.refusal
        else f"Learned: {count} of {len(result.parameters)} parameters are identifiable."
    )
    return [
        Section("", [words], good=not result.refusal),
        Section("", _sizes(result)),
        Section("Parameters", [_parameters(result), _INTERVALS]),
        *gear_sections(result.gears),
    ]


def _sizes(result: LearnedResult) -> list[Table]:
    residuals = result.left_m
    _, unit = length_unit(residuals.robot_file, residuals.learned)
    rows = [
        ("residual, robot file", in_unit(residuals.robot_file, unit)),
        ("residual, learned robot", in_unit(residuals.learned, unit)),
        ("noise alone", in_unit(result.noise_left_m, unit)),
    ]
    frames = [
        (
            run.measured,
            run.run,
            f"{run.rows}",
            f"{run.from_s:.2f} to {run.to_s:.2f}",
            ", ".join(f"{round(UM * value) + 0}" for value in run.frame_shift_m),
            ", ".join(f"{1e3 * value:.2f}" for value in run.frame_turn_rad),
            f"{1e3 * run.clock_s:+.1f}",
        )
        for run in result.runs
    ]
    columns = (
        *("measurement", "run", "rows", "time of the run [s]"),
        *("offset of frame [um]", "and [mrad]", "offset of clock [ms]"),
    )
    slow = (f"deviation below {result.slow_below_Hz:g} Hz", "rms [um]")
    return [Table(slow, rows), Table(columns, frames)]


def _parameters(result: LearnedResult) -> Table:
    effects = [f"effect at the tool {UM * p.effect_m:.2g} um" for p in result.parameters]
    return parameter_table(result.parameters, effects)


def _residual_figure(run: LearnedRunResult) -> go.Figure:
    lines = [
        DrawnLine("robot file", BEFORE, run.time, UM * np.array(run.left_robot_file_m)),
        DrawnLine("learned robot", AFTER, run.time, UM * np.array(run.left_learned_m)),
    ]
    return over_time(lines, "distance [um]", 360, "time of the run [s]", {"rangemode": "tozero"})


def _left_note(result: LearnedResult) -> Note:
    return Note(
        "Distance between the measured and the simulated tool under the same command, below"
        f" {result.slow_below_Hz:g} Hz, with the measuring frame and clock that fit each robot best."
    )


_INTERVALS = Note(
    "Intervals of identifiable parameters are calibrated on simulated robots; the others are as wide as"
    " before the measurement."
)
