"""The report of stability: a verdict, the chart over the speed, the path, feed, part and robot."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from functools import partial

import numpy as np
import plotly.graph_objects as go

from coupling.path.length_text import in_words
from coupling.report.colours import AFTER, BEFORE, DESIRED, GREEN, QUIET
from coupling.report.lengths import state_tolerance
from coupling.report.modes_report import in_joints, part_map
from coupling.report.modes_scene import modes_scene
from coupling.report.result_report import ResultReport
from coupling.report.style import drawn, row, rows
from coupling.results.cut_result import WILL_CHATTER
from coupling.results.modes_result import Grid
from coupling.results.section import Answer, KeyFigure, NextStep, Note, Section, Table, warned
from coupling.results.stability_result import (
    ChartResult,
    StabilityPoint,
    StabilityResult,
)

_MM = 1e3
_CHART = (
    "Limiting depth over the speed of the spindle where the cut is worst, and the frequency of the"
    " vibration at that limit. Below the line the cut is stable; beyond it, deeper islands may be stable"
    " again. No line: {none}. Dotted: a quick estimate (zero order); the cross: the programmed cut."
)
_ALONE = Note(
    "The robot alone, its tool taken as rigid: at high speeds a mode of tool, holder and spindle decides"
    " instead. Give [[stability.tool_mode]] or tool_response in the case."
)
_WITH_TOOL = Note(
    "The grey line is the robot alone, by the quick estimate: where it is higher, the tool decides."
)
_PATH = "Programmed depth and limit along the path; orange crosses chatter. No line: {none}."
_FEED = Note("Limit with the feed turned about the part's z axis, at the worst place.")
_PART = (
    "Limit at the programmed speed, where there is one, and the depth that no speed falls below (by the"
    " quick estimate), with the tool moved about the part. White: {none}, or the robot cannot be there."
)
_SENSITIVE = Note(
    "Limit at the worst place with other gears: damping is the least known of all numbers, and the limit"
    " follows it. A hammer test at the tool replaces both."
)


def stability_report(result: StabilityResult) -> ResultReport:
    """Return what is told of a case's stability."""
    return ResultReport(
        "stability",
        result.case,
        stability_answer(result),
        partial(_sections, result),
        warnings=warned((), result.remarks),
    )


def _sections(result: StabilityResult) -> list[Section]:
    sections = _judgement(result)
    none = f"none up to {_mm(result.deepest_m)} mm"
    alone = _WITH_TOOL if result.tool_modes else _ALONE
    if result.chart is not None:
        chart, note = result.chart, Note(_CHART.format(none=none))
        if any(limit is not None for limit in (*chart.limit_m, *chart.zero_order_m)):
            figure = chart_figure(chart, result.points[result.worst])
            sections.append(Section("Over the speed", [note, alone], "chart", [figure]))
        else:
            speeds = f"{min(chart.rpm):.0f} to {max(chart.rpm):.0f} 1/min"
            words = f"Limit at all speeds from {speeds}: {none}."
            sections.append(Section("Over the speed", [words, alone]))
        path = [path_figure(result.points)]
        sections.append(Section("Along the path", [Note(_PATH.format(none=none))], "path", path))
    if result.over_feed is not None and any(v is not None for v in result.over_feed.limit_m):
        angles, limits = result.over_feed.feed_deg, result.over_feed.limit_m
        polar = feed_figure(angles, limits)
        sections.append(Section("Over the direction of the feed", [_FEED], "feed", [polar]))
    if result.over_part is not None:
        part = result.over_part
        maps = [
            part_map(part.x_m, part.y_m, _millimetres(values), title, "mm")
            for values, title in (
                (part.limit_m, "limit at the programmed speed [mm]"),
                (part.least_m, "no speed falls below [mm]"),
            )
            if any(v is not None for line in values for v in line)
        ]
        if maps:
            sections.append(Section("Over the part", [Note(_PART.format(none=none))], "part", maps))
    return sections


def stability_answer(result: StabilityResult) -> Answer:
    """Return the first screen of a case's stability."""
    case = result.case_file
    worst, tolerance = result.points[result.worst], result.tolerance_m
    is_stable = all(point.stable for point in result.points)
    limit = f"{_limit_mm(worst.limit_m, result)} mm"
    moved = max(point.moved_m for point in result.points)
    steps = [] if tolerance is not None else [state_tolerance(case)]
    steps.append(NextStep.by("Correct the command:", "compensate", case))
    good: bool | None = tolerance is None or moved <= tolerance or None
    if not is_stable:
        good, sentence = False, WILL_CHATTER
        if result.instead_of is not None:
            sentence += " No command was computed."
        rpm = ", ".join(f"{low:.0f} to {high:.0f}" for low, high in result.stable_rpm[:3])
        speeds = f", or at a speed of {rpm} 1/min" if rpm else ""
        place = ("place", case, "--optimise", "stability")
        steps = [
            NextStep(f"Cut less than {limit} deep{speeds}."),
            NextStep.by("Or find a place where it is stable:", *place),
        ]
        if result.instead_of is not None:
            # The folder holds what this page shows.
            words = (*result.instead_of, "--despite-chatter", "--overwrite")
            steps.append(NextStep.by("Or compute it as it is, chattering:", *words))
    elif tolerance is None:
        sentence = (
            f"This cut will not chatter. Its force alone moves the tool by up to {in_words(moved)}."
        )
    else:
        sentence = (
            f"This cut will not chatter. Its force alone moves the tool by up to {in_words(moved)}, your"
            f" tolerance is {in_words(tolerance)}{'' if good else ': correct the command'}."
        )
    time = "" if worst.time is None else f" at t = {worst.time:.2f} s"
    where = f"{'Nearest to chatter' if is_stable else 'Worst'}{time}"
    rigid = (
        "" if result.tool_modes else " The tool is taken as rigid: its own vibration is not seen."
    )
    return Answer(
        sentence=sentence,
        reason=f"{where}: {1e3 * worst.depth_m:.3g} mm deep at {worst.rpm:.0f} 1/min.{rigid}",
        good=good,
        figures=(
            KeyFigure(
                "Stable up to", limit, f"programmed {1e3 * worst.depth_m:.3g} mm, where it is worst"
            ),
            KeyFigure(
                "Vibration",
                f"{worst.frequency_Hz:.3g} Hz",
                "the slowest to decay"
                if is_stable
                else "that grows; seen is the nearest one of the robot",
            ),
            KeyFigure(
                "Moved by the force",
                in_words(moved),
                "on average over a turn, without weight and backlash",
            ),
        ),
        steps=steps,
        scene=None if result.swinging is None else modes_scene(result.swinging, worst.frequency_Hz),
    )


def _judgement(result: StabilityResult) -> list[Section]:
    """Return whether the cuts chatter, what gives way, and at which speeds they would not."""
    worst = result.points[result.worst]
    sections = [
        Section("How it was judged", [f"{result.sentence}.", *_sentences(result, worst)]),
    ]
    if result.sensitivities is not None:
        table = [
            (other.name, _limit_mm(other.limit_m, result), _mm(other.least_m))
            for other in result.sensitivities
        ]
        columns = ("gears", f"limit at {worst.rpm:.0f} 1/min [mm]", "no speed falls below [mm]")
        sections.append(Section("Other gears", [_SENSITIVE, Table(columns, table)]))
    return sections


def _sentences(result: StabilityResult, worst: StabilityPoint) -> Iterator[str]:
    """Yield what else there is to say of the worst cut."""
    unstable = sum(not point.stable for point in result.points)
    if len(result.points) > 1:
        yield f"{unstable} of {len(result.points)} places along the path chatter."
    way = {"Hopf": "", "flip": ", flipping from tooth to tooth", "none": ""}
    kind = "grows" if not worst.stable else "decays"
    yield (
        f"At the worst place the {'slowest ' if worst.stable else ''}vibration {kind} with"
        f" {abs(worst.growth_1_s):.3g} 1/s at {worst.frequency_Hz:.1f} Hz{way[worst.border]}."
    )
    by_tool = f"; the tool's modes have {100.0 * result.tool_share:.0f} % of the motion"
    gives_way = in_joints(result.joints) or "no joint"
    yield f"At the limit gives way: {gives_way}{by_tool if result.tool_modes else ''}."
    if result.islands_m:
        islands = " and ".join(f"{_mm(low)} to {_mm(high)}" for low, high in result.islands_m)
        yield (
            f"Depth is not monotone there: stable again at {islands} mm, beyond a border that a cut"
            " passes as it gets deeper."
        )
    if result.chart is not None:
        ranges = ", ".join(f"{low:.0f} to {high:.0f}" for low, high in result.stable_rpm)
        yield f"Stable speeds at {_mm(worst.depth_m)} mm: {ranges or 'none in the range'} 1/min."
    if not result.tool_modes:
        yield (
            "At high speeds a mode of the tool decides: give [[stability.tool_mode]] or tool_response, a"
            " tap test at the tip."
        )
    unloaded = sorted({joint for point in result.points for joint in point.unloaded_joints})
    if unloaded:
        yield (
            f"The mean force leaves gears of joints {', '.join(map(str, unloaded))} in their backlash at"
            " some places; they are taken as engaged."
        )
    if result.march is not None:
        verdict = "decays" if result.march.stable else "grows"
        yield (
            f"Marched in time for {result.march.seconds:g} s, with edges that leave the cut, the"
            f" vibration {verdict} with {abs(result.march.growth_1_s):.3g} 1/s."
        )


def chart_figure(chart: ChartResult, programmed: StabilityPoint) -> go.Figure:
    """Draw limiting depth over speed, and the frequency of the vibration below it."""
    upright = [{"title": "depth [mm]", "rangemode": "tozero"}, {"title": "frequency [Hz]"}]
    axes = rows((3.0, 2.0), 0.06, upright)
    axes["xaxis2"].update({"title": "spindle [1/min]"})
    rpm = np.array(chart.rpm)
    lines = [
        ("limit", chart.limit_m, AFTER, "solid", 2.0),
        ("quick estimate", chart.zero_order_m, BEFORE, "dot", 1.2),
        ("robot alone", chart.robot_alone_m, QUIET, "dash", 1.2),
    ]
    if chart.robot_alone_m == chart.zero_order_m:
        lines = lines[:2]
    finite = [limit for limit in chart.limit_m if limit is not None]
    highest = _top(finite, programmed.depth_m)
    traces: list[dict[str, object]] = [
        {
            **row(1),
            "x": rpm,
            "y": np.array([np.nan if v is None else _MM * v for v in values]),
            "mode": "lines",
            "name": name,
            "line": {"color": colour, "width": width, "dash": dash},
        }
        for name, values, colour, dash, width in lines
    ]
    traces.append(
        {
            **row(1),
            "x": [programmed.rpm],
            "y": [_MM * programmed.depth_m],
            "mode": "markers",
            "name": "programmed",
            "marker": {"color": DESIRED, "size": 11, "symbol": "x"},
        }
    )
    traces.append(
        {
            **row(2),
            "x": rpm,
            "y": np.array([np.nan if v is None else v for v in chart.frequency_Hz]),
            "mode": "markers",
            "name": "frequency",
            "marker": {"color": GREEN, "size": 4},
        }
    )
    axes["yaxis"]["range"] = [0.0, highest]
    return drawn(traces, 520, **axes)


def _top(limits: Sequence[float], depth: float) -> float:
    """Return where the axis of depths ends [mm]: the limits' upper part is of no use."""
    middle = float(np.quantile(limits, 0.9)) if limits else 2.0 * depth
    return 1.1 * _MM * max(middle, 1.3 * depth)


def path_figure(points: Sequence[StabilityPoint]) -> go.Figure:
    """Draw depth and limit along the path."""
    time = [point.time or 0.0 for point in points]
    depth = np.array([_MM * point.depth_m for point in points])
    limit = _MM * np.array([p.limit_m if np.isfinite(p.limit_m) else np.nan for p in points])
    colours = [AFTER if point.stable else BEFORE for point in points]
    symbols = ["circle" if point.stable else "x" for point in points]
    traces = [
        {
            "x": time,
            "y": limit,
            "mode": "lines",
            "name": "limit",
            "line": {"color": AFTER, "width": 2},
        },
        {
            "x": time,
            "y": depth,
            "mode": "lines+markers",
            "name": "programmed",
            "line": {"color": DESIRED, "width": 1},
            "marker": {"color": colours, "size": 7, "symbol": symbols},
        },
    ]
    finite = [p.limit_m for p in points if np.isfinite(p.limit_m)]
    top = _top(finite, float(depth.max()) / _MM)
    upright = {"title": "depth [mm]", "range": [0.0, top]}
    return drawn(traces, 340, xaxis={"title": "time [s]"}, yaxis=upright)


def feed_figure(angles: Sequence[float], limits: Sequence[float | None]) -> go.Figure:
    """Draw limits over the direction of the feed."""
    values = np.array([np.nan if v is None else _MM * v for v in limits])
    trace = {
        "x": list(angles),
        "y": values,
        "mode": "lines+markers",
        "name": "limit",
        "line": {"color": AFTER, "width": 2},
    }
    return drawn(
        [trace],
        320,
        xaxis={"title": "feed from the part's x axis [deg]", "range": [0, 360], "dtick": 45},
        yaxis={"title": "limit [mm]", "rangemode": "tozero"},
    )


def _millimetres(values: Grid) -> Grid:
    return tuple(tuple(None if v is None else _MM * v for v in line) for line in values)


def _limit_mm(limit: float, result: StabilityResult) -> str:
    """Return a limit [mm], beyond the deepest cut that was looked at where there is none."""
    return _mm(limit) if np.isfinite(limit) else f"> {_mm(result.deepest_m)}"


def _mm(depth: float) -> str:
    return f"{_MM * depth:.3g}" if np.isfinite(depth) else "none"
