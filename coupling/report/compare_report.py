"""Runs beside each other: what each comes to, and in what they differ."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import dataclass, replace
from functools import partial
from math import degrees, isnan
from typing import Any

import numpy as np
import plotly.graph_objects as go

from coupling.path.histories import ToolPath
from coupling.path.length_text import format_um, in_words, length_unit
from coupling.report.background import case_content, case_of, real_part
from coupling.report.colours import JOINTS
from coupling.report.compare_answer import comparison_answer
from coupling.report.comparison import CommandDifference, Comparison, command_difference
from coupling.report.lengths import three_digits
from coupling.report.result_report import ResultReport
from coupling.report.run_figures import tolerance_rule
from coupling.report.run_scene import EXPECTED, named_paths, part_frame, run_scene, track
from coupling.report.style import DrawnLine, over_time
from coupling.report.verdict import verdict
from coupling.results.run_result import RunResult
from coupling.results.scene import Scene
from coupling.results.section import Note, Part, Section, Table
from coupling.run.stored_run import StoredRobot

_STAGES = ("before compensation", "after, if the file is right")
_DEVIATIONS = (
    ("maximum", "max"),
    ("rms", "rms"),
    ("normal_maximum", "across travel"),
    ("maximum_less_constant", "max less a constant"),
    ("rms_less_constant", "rms less a constant"),
)


def comparison_report(comparison: Comparison) -> ResultReport:
    """Return what is told of runs beside each other."""
    return ResultReport(
        "compare",
        f"{comparison.runs[0].figures.case}, {' beside '.join(comparison.names)}",
        comparison_answer(comparison),
        partial(_sections, comparison),
        scene=partial(comparison_scene, comparison),
    )


def _sections(comparison: Comparison) -> list[Section]:
    """Return what runs come to and in what they differ."""
    drawn = [part for robot in comparison.robots() for part in _of_robot(comparison, *robot)]
    return [*_head(comparison), *drawn, _inputs(comparison)]


def comparison_scene(comparison: Comparison) -> Scene:
    """Return all paths in one scene, with the robots of the first run."""
    first = comparison.runs[0]
    frame = part_frame(real_part(first.figures, case_of(first)))
    scene = run_scene(first, frame, case_content(first))
    several = len(first.robots) > 1
    tracks = []
    for name, robots in comparison.robots():
        first_path, *others = (path for path in _paths(comparison, robots) if path.is_shown)
        # The first two are seen at first: without a correction, and the last of all.
        tracks += [
            replace(track(path.name, path.desired, path.actual), robot=name if several else "")
            for path in (first_path, *others[-1:], *others[:-1])
        ]
    return replace(scene, tracks=tracks)


@dataclass(frozen=True)
class _ComparedPath:
    """A path among others.

    Attributes:
        name, color, dash: Its entry in the legend.
        desired, actual: Desired and actual path of its tool.
        part: Placement of its part, by the keys of [part].
        is_shown: Whether it is shown at first.
    """

    name: str
    color: str
    desired: ToolPath
    actual: ToolPath
    part: Any
    dash: str = "solid"
    is_shown: bool = True


def _paths(comparison: Comparison, robots: list[StoredRobot]) -> Iterator[_ComparedPath]:
    """Yield a robot's paths: of every run those that its page has, and what was measured under it.

    Where it tells what is to be expected, that is shown at first, and not what the file's robot leaves.
    """
    for number, (name, run, stored) in enumerate(
        zip(comparison.names, comparison.runs, robots, strict=True)
    ):
        color, part = JOINTS[number % len(JOINTS)], real_part(run.figures, case_of(run))
        paths = named_paths(stored)
        first, *others = paths
        to_go_by = EXPECTED if EXPECTED in paths else first if not others else others[0]
        for words, path in paths.items():
            yield _ComparedPath(
                f"{name}: {words}",
                color,
                stored.desired,
                path,
                part,
                "solid" if words == to_go_by else "dot" if words == first else "longdash",
                words == to_go_by or (words == first and number == 0),
            )
        if number in comparison.measured and stored is run.first:
            measured = comparison.measured[number]
            yield _ComparedPath(
                f"{name}: measured", color, measured.desired, measured.actual, part, "dash"
            )


def _head(comparison: Comparison) -> list[Section]:
    """Return the figures of all runs beside each other, what was taken off measurements, verdicts."""
    verdicts = [
        replace(
            verdict(run.figures, case_of(run).process.model),
            title=f"How {name} was computed",
            good=None,
        )
        for name, run in zip(comparison.names, comparison.runs, strict=True)
    ]
    rows = []
    for number, measured in sorted(comparison.measured.items()):
        run = measured.run
        rows.append(
            (
                comparison.names[number],
                run.measured.name,
                in_words(run.size.maximum),
                in_words(run.size.rms),
                f"{1e3 * run.clock:+.1f}",
                ", ".join(format_um(value) for value in run.shift),
                in_words(run.noise),
                str(run.left_out),
            )
        )
    columns = (
        *("run", "file", "largest", "rms", "clock [ms]"),
        *("frame [um]", "noise", "samples left out"),
    )
    understood = [
        f"{tool.file.name}: {tool.run.measured.understood.sentence}."
        for _, tool in sorted(comparison.measured.items())
        if tool.run.measured.understood is not None
    ]
    parts: list[Part] = [_MEASURED, Table(columns, rows), *understood]
    taken_off = [Section("Measured", parts)] if rows else []
    return [*taken_off, Section("Figures", [_figures(comparison)]), *verdicts]


def _figures(comparison: Comparison) -> Table:
    """Return the figures of all runs beside each other."""
    results = [run.figures for run in comparison.runs]

    def row(
        name: str,
        figure: Callable[[RunResult], float | None],
        words: Callable[[float], str] = in_words,
    ) -> tuple[str, ...]:
        values = map(figure, results)
        return (name, *("-" if v is None or isnan(v) else words(v) for v in values))

    def deviation(figures: RunResult, stage: int, key: str) -> float | None:
        whole = figures.deviations
        return float(getattr(whole[stage], key)) if stage < len(whole) else None

    def replay(figures: RunResult, name: str) -> float | None:
        sizes = (r.deviation.maximum for r in figures.robustness if r.name == name)
        return next(sizes, None)

    rows = [
        row(
            f"deviation {name}, {words}",
            partial(deviation, stage=stage, key=key),
        )
        for stage, name in enumerate(_STAGES)
        for key, words in _DEVIATIONS
    ]
    rows += [
        row("gravity, before", lambda figures: figures.shares_m.gravity.maximum),
        row("process, before", lambda figures: figures.shares_m.process.maximum),
        row("peak force [N]", lambda figures: figures.peak_force_N, three_digits),
        row("evaluations of the process", lambda figures: figures.process_evaluations, str),
        row("rows of the command", lambda figures: figures.command.rows, str),
    ]
    names = dict.fromkeys(entry.name for figures in results for entry in figures.robustness)
    rows += [row(f"left on a robot with {name}", partial(replay, name=name)) for name in names]
    return Table(("", *comparison.names), rows)


def _of_robot(comparison: Comparison, robot: str, robots: list[StoredRobot]) -> list[Section]:
    """Return the sections of one robot in all runs."""
    whose, mark = _whose(comparison, robot)
    paths = list(_paths(comparison, robots))
    return [
        Section(
            f"Deviation along the path{whose}",
            [_ALONG],
            f"deviation{mark}",
            [_deviations(paths, comparison)],
        ),
        *_commands(comparison, robot, robots),
    ]


def _whose(comparison: Comparison, robot: str) -> tuple[str, str]:
    """Return how headings and names of figures tell robots apart."""
    several = len(comparison.runs[0].robots) > 1
    return (f", {robot} robot", f"_{robot}") if several else ("", "")


def _commands(comparison: Comparison, robot: str, robots: list[StoredRobot]) -> list[Section]:
    """Return how far the commands of a robot are from that of the first run."""
    whose, mark = _whose(comparison, robot)
    sections = []
    for number, other in enumerate(robots[1:], start=1):
        difference = command_difference(robots[0], other)
        parts = [f"{_in_words(robots[0], other)}."]
        sections.append(
            Section(
                f"Commands: {comparison.names[number]} minus {comparison.names[0]}{whose}",
                parts if difference is None else [*parts, _joints(difference)],
                f"commands{mark}{number}",
                [] if difference is None else [_angles(difference)],
            )
        )
    return sections


def _deviations(paths: list[_ComparedPath], comparison: Comparison) -> go.Figure:
    """Draw the deviations of all runs on one scale."""
    distances = [path.actual.distance_to(path.desired) for path in paths]
    factor, unit = length_unit(*(float(distance.max()) for distance in distances))
    lines = [
        DrawnLine(path.name, path.color, path.actual.time, factor * distance, dash=path.dash)
        for path, distance in zip(paths, distances, strict=True)
    ]
    allowed = case_of(comparison.runs[0]).part.tolerance_mm
    shapes = [] if allowed is None else [tolerance_rule(1e-3 * factor * allowed)]
    upright = {"rangemode": "tozero"}
    figure = over_time(
        lines, f"distance [{unit}]", 400, yaxis=upright, shapes=shapes, meta={"log": True}
    )
    for path, drawn in zip(paths, figure.data, strict=True):
        drawn.visible = True if path.is_shown else "legendonly"
    return figure


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


_MEASURED = Note(
    "Measured paths on the clock and in the frame of their runs. What was taken off the device's clock"
    " and frame is listed; it is fitted to the robot of the last run, as next does, and so changes a"
    " little as the robot becomes better known. A shift of the whole path is not seen where the frame is"
    " unknown."
)
_ALONG = Note(
    "Distance between actual and desired TCP at equal times; dotted: before; solid: on a robot to be"
    " expected, where its file says how exact it is; dashed: measured. Names above show and hide curves,"
    " such as what is left if the file is right."
)
