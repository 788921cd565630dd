"""The page of two runs side by side, and the same in lines."""

from __future__ import annotations

import html
from collections.abc import Callable
from functools import partial
from math import degrees, isnan
from pathlib import Path
from typing import Any

import numpy as np
import plotly.graph_objects as go

from coupling.errors import ResultError
from coupling.files.whole_file import make_folder_of, write_whole
from coupling.path.deviation import Deviation
from coupling.report.background import case_of, real_part
from coupling.report.colours import AFTER, BEFORE, JOINTS
from coupling.report.comparison import CommandDifference, Comparison, command_difference
from coupling.report.document import Section, document
from coupling.report.style import UM, curve, distance_curve, log_axis, style
from coupling.report.tables import table
from coupling.report.verdict import verdict
from coupling.report.views import PathView, from_above
from coupling.results.run_result import RunResult
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


def write_comparison(found: Comparison, file: Path) -> Path:
    """Write the page of two runs side by side; return the file.

    Raises:
        ResultError: If the case of a run is damaged, or the page cannot be written.
    """
    page = comparison_page(found)
    make_folder_of(file, ResultError)
    write_whole(file, page, ResultError)
    return file


def comparison_page(found: Comparison) -> str:
    """Return the page as one self-contained HTML text."""
    head = "".join(
        f"<h2>{html.escape(name)}</h2>" + verdict(run.figures, case_of(run).process.model)
        for name, run in zip(found.names, found.runs, strict=True)
    )
    head += _figures(found)
    sections: list[Section] = []
    for robot, first, second in found.robots():
        sections += _sections(found, robot, first, second)
    sections.append(("Inputs that differ", "", (), _inputs(found)))
    return document(f"{found.names[0]} and {found.names[1]}", head, sections)


def comparison_lines(found: Comparison) -> list[str]:
    """Return what two runs come to and in what they differ, a line each."""
    lines = []
    for name, run in zip(found.names, found.runs, strict=True):
        own = run.figures
        state = "converged" if own.converged else "NOT CONVERGED"
        each = "; ".join(
            f"{stage} {_largest(deviation)}"
            for stage, deviation in zip(_STAGES, own.deviations, strict=False)
        )
        lines.append(f"{name}: {state}, deviation {each}; peak force {own.peak_force_N:.1f} N")
    for robot, first, second in found.robots():
        whose = "" if len(found.runs[0].robots) == 1 else f" of the {robot} robot"
        lines.append(f"Commands{whose}: {_in_words(first, second)}")
    differing = found.inputs()
    lines.append(f"Inputs that differ: {len(differing) or 'none'}")
    return lines + [f"  {key}: {own} | {other}" for key, own, other in differing]


def _largest(found: Deviation) -> str:
    text = f"max {UM * found.maximum:.2f} um, rms {UM * found.rms:.2f} um"
    if not isnan(found.maximum_less_constant):  # a run of an earlier version has none
        most, rms = UM * found.maximum_less_constant, UM * found.rms_less_constant
        text += f" (less a constant {most:.2f} um, {rms:.2f} um)"
    return text


def _figures(found: Comparison) -> str:
    """Return the figures of both runs beside each other."""
    own, other = (run.figures for run in found.runs)

    def row(
        name: str, told: Callable[[RunResult], float | None], digits: int = 2
    ) -> tuple[str, ...]:
        return (name, *(_cell(told(figures), digits) for figures in (own, other)))

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
    names = dict.fromkeys(entry.name for figures in (own, other) for entry in figures.robustness)
    for name in names:
        values = [
            next((r.deviation_m.maximum for r in f.robustness if r.name == name), None)
            for f in (own, other)
        ]
        cells = (_cell(value and UM * value, 2) for value in values)
        rows.append((f"left on a robot with {html.escape(name)} [um]", *cells))
    return table(("", *map(html.escape, found.names)), rows)


def _cell(value: float | None, digits: int) -> str:
    return "-" if value is None or isnan(value) else f"{value:.{digits}f}"


def _sections(
    found: Comparison, robot: str, first: StoredRobot, second: StoredRobot
) -> list[Section]:
    """Return the sections of one robot in both runs."""
    several = len(found.runs[0].robots) > 1
    whose, mark = (f", {html.escape(robot)} robot", f"_{robot}") if several else ("", "")
    pairs = list(zip(found.names, found.runs, (first, second), strict=True))
    views = []
    for name, run, own in pairs:
        *_, (stage, path) = own.actual.items()
        part = real_part(run.figures, case_of(run))
        views.append(PathView(f"{name}: {stage}", own.desired, path, part))
    difference = command_difference(first, second)
    sections: list[Section] = [
        (f"Deviation along the path{whose}", f"deviation{mark}", _deviations(pairs), _ALONG_TEXT),
        (f"The part from above{whose}", f"above{mark}", from_above(views), _ABOVE_TEXT),
    ]
    words = f"<p>{_in_words(first, second)}.</p>"
    drawn: go.Figure | tuple[go.Figure, ...] = ()
    if difference is not None:
        words += _joints(difference)
        drawn = _commands(difference)
    title = f"Commands: {html.escape(found.names[1])} minus {html.escape(found.names[0])}{whose}"
    return [*sections, (title, f"commands{mark}", drawn, words)]


def _deviations(pairs: list[tuple[str, Any, StoredRobot]]) -> go.Figure:
    """Draw the deviations of both runs on one scale."""
    figure = go.Figure()
    for (name, _, own), color in zip(pairs, _COLOURS, strict=True):
        stages = list(own.actual.items())
        for stage, path in stages:
            line = {
                "color": color,
                "width": 1.5,
                "dash": "solid" if path is stages[-1][1] else "dot",
            }
            points = distance_curve(path.time, path.distance_to(own.desired))
            figure.add_scatter(**points, mode="lines", name=f"{name}: {stage}", line=line)
    figure.update_yaxes(log_axis(title="distance [um]"))
    figure.update_xaxes(title="time [s]")
    return style(figure, 400)


def _commands(difference: CommandDifference) -> go.Figure:
    """Draw the difference of two commands."""
    figure = go.Figure()
    for joint, own in enumerate(np.degrees(difference.angle).T):
        line = {"color": JOINTS[joint % len(JOINTS)], "width": 1.3}
        points = curve(difference.time, own)
        figure.add_scatter(
            **points, mode="lines", name=f"joint {joint + 1}", showlegend=True, line=line
        )
    figure.update_yaxes(title="angle [deg]", exponentformat="none")
    figure.update_xaxes(title="time [s]")
    return style(figure, 320)


def _joints(difference: CommandDifference) -> str:
    rows = [
        (
            f"joint {joint + 1}",
            f"{degrees(np.abs(own).max()):.4f}",
            f"{degrees(np.sqrt(np.mean(own**2))):.4f}",
            f"{difference.time[np.abs(own).argmax()]:.3f}",
        )
        for joint, own in enumerate(difference.angle.T)
    ]
    return table(("angle [deg]", "max", "rms", "at t = [s]"), rows)


def _in_words(first: StoredRobot, second: StoredRobot) -> str:
    """Return how far two commands are apart, in plain text."""
    difference = command_difference(first, second)
    if difference is None:
        counts = [own.joints.q[0].shape[1] for own in (first, second)]
        return f"of {counts[0]} and {counts[1]} joints, not to be compared"
    angle, joint, time = difference.largest
    if angle == 0.0:
        return "the same"
    text = f"apart by at most {degrees(angle):.4g} deg, joint {joint} at t = {time:.3f} s"
    ends = [float(own.joints.time[-1]) for own in (first, second)]
    if abs(ends[0] - ends[1]) > 1e-9:
        text += f", while both last: they take {ends[0]:.3f} and {ends[1]:.3f} s"
    return text


def _inputs(found: Comparison) -> str:
    rows = [tuple(map(html.escape, row)) for row in found.inputs()]
    if not rows:
        return "<p>None: case, robots and programs are the same.</p>"
    return table(("input", *map(html.escape, found.names)), rows, "words")


_ALONG_TEXT = "<p>Distance between actual and desired TCP at equal times; dotted: before.</p>"
_ABOVE_TEXT = (
    "<p>The paths that are left, along their part's z axis, coloured by the distance of the actual from"
    " the desired TCP, both on one logarithmic scale.</p>"
)
