"""Two runs side by side: what they come to, and in what they differ."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from functools import partial
from math import degrees, isnan
from pathlib import Path
from typing import Any

import numpy as np
import plotly.graph_objects as go

from coupling.errors import ResultError
from coupling.report.background import case_of, real_part
from coupling.report.colours import AFTER, BEFORE, JOINTS
from coupling.report.comparison import CommandDifference, Comparison, command_difference
from coupling.report.document import document
from coupling.report.report_file import write_page
from coupling.report.style import DrawnLine, log_axis, over_time, shown_distance
from coupling.report.verdict import verdict
from coupling.report.views import PathView, from_above
from coupling.results.run_result import RunResult
from coupling.results.section import UM, Note, Section, Table
from coupling.run.stored_run import StoredRobot

_COLOURS = (BEFORE, AFTER)
_STAGES = ("before", "after")
_DEVIATIONS = (
    ("maximum", "max"),
    ("rms", "rms"),
    ("normal_maximum", "across travel"),
    ("maximum_less_constant", "max less a constant"),
    ("rms_less_constant", "rms less a constant"),
)


def write_comparison(comparison: Comparison, file: Path) -> Path:
    """Write the page of two runs side by side; return the file.

    Raises:
        ResultError: If the case of a run is damaged, or the page cannot be written.
    """
    text = comparison_page(comparison)
    write_page(file, text, ResultError)
    return file


def comparison_page(comparison: Comparison) -> str:
    """Return the page as one self-contained HTML text."""
    drawn = [part for robot in comparison.robots() for part in _sections(comparison, *robot)]
    sections = [*_head(comparison), *drawn, _inputs(comparison)]
    return document(f"{comparison.names[0]} and {comparison.names[1]}", sections)


def comparison_summary(comparison: Comparison) -> list[Section]:
    """Return what two runs come to and in what they differ."""
    commands = [_commands(comparison, *robot) for robot in comparison.robots()]
    return [*_head(comparison), *commands, _inputs(comparison)]


def _head(comparison: Comparison) -> list[Section]:
    """Return verdicts, and the figures of both runs beside each other."""
    verdicts = [
        replace(verdict(run.figures, case_of(run).process.model), title=name)
        for name, run in zip(comparison.names, comparison.runs, strict=True)
    ]
    return [*verdicts, Section("Figures", [_figures(comparison)])]


def _figures(comparison: Comparison) -> Table:
    """Return the figures of both runs beside each other."""
    first, second = (run.figures for run in comparison.runs)

    def row(
        name: str, figure: Callable[[RunResult], float | None], digits: int = 2
    ) -> tuple[str, ...]:
        return (name, *(_cell(figure(figures), digits) for figures in (first, second)))

    def deviation(figures: RunResult, stage: int, key: str) -> float | None:
        whole = figures.deviations
        return UM * getattr(whole[stage], key) if stage < len(whole) else None

    rows = [
        row(
            f"deviation {name} compensation, {words} [um]",
            partial(deviation, stage=stage, key=key),
        )
        for stage, name in enumerate(_STAGES)
        for key, words in _DEVIATIONS
    ]
    rows += [
        row("gravity, before [um]", lambda figures: UM * figures.shares_m.gravity.maximum),
        row("process, before [um]", lambda figures: UM * figures.shares_m.process.maximum),
        row("peak force [N]", lambda figures: figures.peak_force_N, 1),
        row("evaluations of the process", lambda figures: figures.process_evaluations, 0),
        row("rows of the command", lambda figures: figures.command.rows, 0),
    ]
    names = dict.fromkeys(entry.name for figures in (first, second) for entry in figures.robustness)
    for name in names:
        values = [
            next((r.deviation.maximum for r in f.robustness if r.name == name), None)
            for f in (first, second)
        ]
        cells = (_cell(value and UM * value, 2) for value in values)
        rows.append((f"left on a robot with {name} [um]", *cells))
    return Table(("", *comparison.names), rows)


def _cell(value: float | None, digits: int) -> str:
    return "-" if value is None or isnan(value) else f"{value:.{digits}f}"


def _sections(
    comparison: Comparison, robot: str, first: StoredRobot, second: StoredRobot
) -> list[Section]:
    """Return the sections of one robot in both runs."""
    whose, mark = _whose(comparison, robot)
    pairs = list(zip(comparison.names, comparison.runs, (first, second), strict=True))
    views = []
    for name, run, stored in pairs:
        *_, (stage, path) = stored.actual.items()
        part = real_part(run.figures, case_of(run))
        views.append(PathView(f"{name}: {stage}", stored.desired, path, part))
    along = f"Deviation along the path{whose}"
    above = f"The part from above{whose}"
    difference = command_difference(first, second)
    return [
        Section(along, [_ALONG], f"deviation{mark}", [_deviations(pairs)]),
        Section(above, [_ABOVE], f"above{mark}", from_above(views)),
        replace(
            _commands(comparison, robot, first, second),
            name=f"commands{mark}",
            figures=[] if difference is None else [_angles(difference)],
        ),
    ]


def _whose(comparison: Comparison, robot: str) -> tuple[str, str]:
    """Return how headings and names of figures tell robots apart."""
    several = len(comparison.runs[0].robots) > 1
    return (f", {robot} robot", f"_{robot}") if several else ("", "")


def _commands(
    comparison: Comparison, robot: str, first: StoredRobot, second: StoredRobot
) -> Section:
    """Return how far the commands of a robot are apart."""
    difference = command_difference(first, second)
    joints = [] if difference is None else [_joints(difference)]
    title = (
        f"Commands: {comparison.names[1]} minus {comparison.names[0]}{_whose(comparison, robot)[0]}"
    )
    return Section(title, [f"{_in_words(first, second)}.", *joints])


def _deviations(pairs: list[tuple[str, Any, StoredRobot]]) -> go.Figure:
    """Draw the deviations of both runs on one scale."""
    lines = []
    for (name, _, stored), color in zip(pairs, _COLOURS, strict=True):
        *_, last = stored.actual
        for stage, path in stored.actual.items():
            distance = shown_distance(path.distance_to(stored.desired))
            dash = "solid" if stage == last else "dot"
            lines.append(DrawnLine(f"{name}: {stage}", color, path.time, distance, dash=dash))
    return over_time(lines, "distance [um]", 400, yaxis=log_axis())


def _angles(difference: CommandDifference) -> go.Figure:
    """Draw the difference of two commands."""
    lines = [
        DrawnLine(f"joint {joint + 1}", JOINTS[joint % len(JOINTS)], difference.time, angle, 1.3)
        for joint, angle in enumerate(np.degrees(difference.angle).T)
    ]
    return over_time(lines, "angle [deg]", 320, yaxis={"exponentformat": "none"})


def _joints(difference: CommandDifference) -> Table:
    rows = [
        (
            f"joint {joint + 1}",
            f"{degrees(np.abs(angle).max()):.4f}",
            f"{degrees(np.sqrt(np.mean(angle**2))):.4f}",
            f"{difference.time[np.abs(angle).argmax()]:.3f}",
        )
        for joint, angle in enumerate(difference.angle.T)
    ]
    return Table(("angle [deg]", "max", "rms", "at t = [s]"), rows)


def _in_words(first: StoredRobot, second: StoredRobot) -> str:
    """Return how far two commands are apart, in plain text."""
    difference = command_difference(first, second)
    if difference is None:
        counts = [stored.joints.q[0].shape[1] for stored in (first, second)]
        return f"Not comparable: {counts[0]} and {counts[1]} joints"
    angle, joint, time = difference.largest
    if angle == 0.0:
        return "Identical"
    text = f"Largest difference {degrees(angle):.4g} deg, joint {joint} at t = {time:.3f} s"
    ends = [float(stored.joints.time[-1]) for stored in (first, second)]
    if abs(ends[0] - ends[1]) > 1e-9:
        text += f", in the time common to both: they take {ends[0]:.3f} and {ends[1]:.3f} s"
    return text


def _inputs(comparison: Comparison) -> Section:
    rows = comparison.inputs()
    none = "None: case, robots and programs are the same."
    listed = Table(("input", *comparison.names), rows, "words") if rows else none
    return Section("Inputs that differ", [listed])


_ALONG = Note("Distance between actual and desired TCP at equal times; dotted: before.")
_ABOVE = Note(
    "The last paths, along their part's z axis, coloured by the deviation normal to the part, positive"
    " away from it, all on one scale."
)
