"""The page of how a next command was found: measured runs, convergence, forecast."""

from __future__ import annotations

import numpy as np
import plotly.graph_objects as go

from coupling.path.length_text import format_um
from coupling.report.colours import JOINTS
from coupling.report.document import document
from coupling.report.learn_report import learned_figures, learned_summary
from coupling.report.style import DrawnLine, over_time
from coupling.results.learned_result import LearnedResult
from coupling.results.next_result import NextResult, PathCorrectionResult
from coupling.results.section import UM, Answer, Note, Section, Table

_TIME = "time of the run [s]"


def next_page(title: str, result: NextResult, learned: LearnedResult | None, answer: Answer) -> str:
    """Return the page of a next command as one self-contained HTML text.

    Args:
        title: Title of the page.
        result: Its figures, the content of next.json.
        learned: Parameters that were learned for it, the content of learned.json.
        answer: First screen.
    """
    sections = [
        *next_summary(result, learned),
        Section("What was measured", [_MEASURED], "measured-runs", [_distances(result)]),
    ]
    if result.correction is not None:
        heading = "Correction along the path"
        sections.append(Section(heading, [], "correction", [_correction(result.correction)]))
    if learned is not None:
        sections += learned_figures(learned)
    return document(title, sections, answer)


def next_summary(result: NextResult, learned: LearnedResult | None) -> list[Section]:
    """Return how a next command is computed, and what to expect of it once that is known."""
    forecast = [] if result.forecast is None else [f"{result.forecast.sentence}."]
    return [
        Section("How it was computed", [*forecast, *result.sentences]),
        Section("Measured runs", _runs(result)),
        *([] if learned is None else learned_summary(learned)),
    ]


def _runs(result: NextResult) -> list[Table]:
    sizes, devices = [], []
    for number, run in enumerate(result.runs, start=1):
        size, forecast = run.size_m, run.forecast
        expected = (
            "" if forecast is None else f"{format_um(forecast.low)} to {format_um(forecast.high)}"
        )
        sizes.append(
            (
                f"{number}",
                f"{run.measured} under {run.run}",
                f"{format_um(size.rms)} / {format_um(size.maximum)}",
                f"{format_um(size.rms_less_constant)} / {format_um(size.maximum_less_constant)}",
                format_um(size.fast),
                expected,
            )
        )
        devices.append(
            (
                f"{number}",
                format_um(run.noise_m),
                ", ".join(f"{round(UM * value) + 0}" for value in run.frame_shift_m),
                ", ".join(f"{1e3 * value:.2f}" for value in run.frame_turn_rad),
                ", ".join(format_um(value) for value in run.tip_m),
                f"{1e3 * run.clock_s:+.1f}",
                f"{run.left_out}",
            )
        )
    columns = (
        *("run", "measured", "rms / largest [um]", "less a constant [um]"),
        *("faster than 15 Hz [um]", "forecast of the rms [um]"),
    )
    off = (
        *("run", "noise [um]", "offset of frame [um]", "and [mrad]", "offset of tip [um]"),
        *("offset of clock [ms]", "samples left out"),
    )
    return [Table(columns, sizes), Table(off, devices)]


def _distances(result: NextResult) -> go.Figure:
    lines = []
    for number, run in enumerate(result.runs, start=1):
        # The colour of the last run is always the same.
        color = JOINTS[(len(result.runs) - number) % len(JOINTS)]
        distance = UM * np.array(run.distance_m)
        lines.append(DrawnLine(f"run {number}: {run.measured}", color, run.time, distance, 1.2))
    label = "distance from the desired path [um]"
    return over_time(lines, label, 380, _TIME, {"rangemode": "tozero"})


def _correction(correction: PathCorrectionResult) -> go.Figure:
    deviation = UM * np.array(correction.deviation_m)
    lines = [
        DrawnLine(axis, color, correction.time, values)
        for axis, color, values in zip("xyz", JOINTS, deviation.T, strict=False)
    ]
    return over_time(lines, "beyond the model, base axes [um]", 320, _TIME)


_MEASURED = Note(
    "Distance of the measured tool from its desired path, noise of the measurement included."
)
