"""Figures along the path: how far the tool is off, and which gear reverses there."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
import plotly.graph_objects as go

from coupling.path.histories import ToolPath
from coupling.report.colours import AFTER, BEFORE, DESIRED, GREEN, PLANT, QUIET
from coupling.report.run_tables import mode_names
from coupling.report.shares import spike
from coupling.report.style import (
    FLOOR_UM,
    DrawnLine,
    Keys,
    curve,
    drawn,
    log_axis,
    over_time,
    row,
    rows,
    shown_distance,
)
from coupling.results.gear_result import BacklashReversal
from coupling.results.section import UM
from coupling.run.stored_run import StoredRobot

_STAGES = (BEFORE, AFTER)
# Height of a row of labels, of the curves and of a gear's row below them [px].
_LABEL, _CURVES, _GEAR = 20, 300, 26
# Labels of one gear at most, and how far they are apart, as a part of the path's time.
_LABELS, _APART = 4, 0.2


def deviation(run: StoredRobot) -> go.Figure:
    """Distance of the actual paths to the desired one, with the gears that reverse."""
    changes = run.figures.reversals
    gears = sorted({change.joint for change in changes})
    below = _GEAR * len(gears)
    height = _CURVES + _LABEL * len(gears) + below
    traces: list[Keys] = []
    mode, other_mode = mode_names(run.figures.mode)
    for (stage, path), color in zip(run.actual.items(), _STAGES, strict=False):
        paths = [(f"{stage}, {mode}", path, "solid", 1.5)]
        if stage in run.other:
            paths.append((f"{stage}, {other_mode}", run.other[stage], "dot", 1.0))
        for name, path, dash, width in paths:
            line = {"color": color, "dash": dash, "width": width}
            traces.append(_distance(run, name, path, line))
    if run.plant is not None:
        line = {"color": PLANT, "width": 1.5}
        traces.append(_distance(run, "on the plant", run.plant, line))
    ends, labels = _labels(traces, run, gears)
    closer = {"dtick": "D2"} if ends[1] - ends[0] < 2.0 else {}
    upright: list[Keys] = [log_axis(title="distance [um]", range=ends, **closer)]
    shares = [1.0]
    if gears:
        traces += _gears(changes, gears)
        upright.append(_gear_axis(gears))
        shares = [height - below, below]
    axes = rows(shares, 0.06, upright)
    return drawn(traces, height + 74, annotations=labels, **axes)


def _distance(run: StoredRobot, name: str, path: ToolPath, line: Keys) -> Keys:
    """Return the curve of a path's distance to the desired one."""
    points = curve(path.time, shown_distance(path.distance_to(run.desired)))
    return {**points, "name": name, "mode": "lines", "line": line, **row(1)}


def _labels(
    traces: Sequence[Keys], run: StoredRobot, gears: list[int]
) -> tuple[list[float], list[Keys]]:
    """Name the gears at the largest spikes of their reversals, each in a row above the curves.

    Returns:
        Ends of the upright axis, decimal logarithms, and the labels.
    """
    shown = np.log10(np.concatenate([trace["y"] for trace in traces]))
    smallest, largest = float(shown.min()), float(shown.max())
    span = max(largest - smallest, 1.0)
    high = _LABEL * span / _CURVES
    top = largest + 0.05 * span
    ends = [smallest - 0.05 * span, top + high * (len(gears) + 0.3)]
    return ends, [
        {
            "x": time,
            "y": np.log10(max(UM * distance, FLOOR_UM)),
            "ax": time,
            "ay": top + high * (number + 0.5),
            "axref": "x",
            "ayref": "y",
            "text": f"joint {joint}",
            "font": {"size": 11},
            "showarrow": True,
            "arrowhead": 6,
            "arrowsize": 0.6,
            "arrowwidth": 1,
            "arrowcolor": QUIET,
            "standoff": 2,
        }
        for number, joint in enumerate(reversed(gears))
        for time, distance in labelled(run, joint)
    ]


def labelled(run: StoredRobot, joint: int) -> list[tuple[float, float]]:
    """Return times [s] and heights [m] of the largest spikes where a gear reverses."""
    *_, path = run.actual.values()
    distance = path.distance_to(run.desired)
    reversals = [c for c in run.figures.reversals if c.joint == joint]
    spikes = sorted(
        (spike(path.time, distance, change) for change in reversals), key=lambda s: -s[1]
    )
    apart = _APART * float(np.ptp(path.time))
    spans: list[tuple[float, float]] = []
    for time, height in spikes:
        if len(spans) < _LABELS and all(abs(time - other) > apart for other, _ in spans):
            spans.append((time, height))
    return spans


def _gears(changes: Sequence[BacklashReversal], gears: list[int]) -> list[Keys]:
    """Return when which gear is in its backlash, and which flank it reaches."""
    heights = {joint: number for number, joint in enumerate(gears)}
    in_backlash = {
        "x": [time for c in changes for time in (c.begins, c.ends, None)],
        "y": [heights[c.joint] for c in changes for _ in range(3)],
        "mode": "lines",
        "name": "gear in its backlash",
        "line": {"color": QUIET, "width": 6},
        "hoverinfo": "skip",
        **row(2),
    }
    traces: list[Keys] = [in_backlash]
    for side, symbol, color in ((1, "triangle-up", BEFORE), (-1, "triangle-down", AFTER)):
        changes_to_side = [c for c in changes if c.after == side]
        reached = {
            "x": [c.ends for c in changes_to_side],
            "y": [heights[c.joint] for c in changes_to_side],
            "mode": "markers",
            "name": f"reaches its {'upper' if side > 0 else 'lower'} flank",
            "marker": {"symbol": symbol, "color": color, "size": 7},
            "text": [_hint(c) for c in changes_to_side],
            "hoverinfo": "text",
            **row(2),
        }
        traces.append(reached)
    return traces


def _gear_axis(gears: list[int]) -> Keys:
    return {
        "tickvals": list(range(len(gears))),
        "ticktext": [f"joint {joint}" for joint in gears],
        "range": [-0.7, len(gears) - 0.3],
        "zeroline": False,
    }


def _hint(change: BacklashReversal) -> str:
    return f"joint {change.joint}, {change.begins:.4f} to {change.ends:.4f} s"


def components(run: StoredRobot) -> go.Figure:
    """Deviation of the first of the actual paths by axis."""
    first, path = next(iter(run.actual.items()))
    difference = UM * (path.position[0] - run.desired.position[0])
    lines = [
        DrawnLine(axis, color, run.desired.time, values)
        for axis, color, values in zip("xyz", (AFTER, GREEN, BEFORE), difference.T, strict=True)
    ]
    return over_time(lines, f"{first.split()[0]} [um]", 280)


def wrench(run: StoredRobot) -> go.Figure:
    """Force and moment on the tool over time."""
    moments = bool(np.any(run.wrench.wrench[..., 3:]))
    kinds = (("f", "force [N]", "solid"), ("m", "moment [N m]", "dot"))[: 1 + moments]
    traces = [
        {
            **curve(run.wrench.time, run.wrench.wrench[0, :, k + 3 * number]),
            "name": f"{letter}{axis}",
            "mode": "lines",
            "line": {"color": color, "width": 1.5, "dash": dash},
            **row(number + 1),
        }
        for k, (axis, color) in enumerate(zip("xyz", (AFTER, GREEN, BEFORE), strict=True))
        for number, (letter, _, dash) in enumerate(kinds)
    ]
    axes = rows([1.0] * len(kinds), 0.08, [{"title": title} for _, title, _ in kinds])
    return drawn(traces, 300 + 180 * moments, **axes)


def convergence(run: StoredRobot) -> go.Figure:
    """Path change of every process evaluation and deviation of every iteration, logarithmic."""
    traces: list[Keys] = []
    count = 0
    ends: list[tuple[int, float]] = []
    for entry in run.figures.iterations:
        numbers = [count + k + 1 for k in range(len(entry.evaluations))]
        for name, changes, dash in (
            ("max", [evaluation.path_change for evaluation in entry.evaluations], "solid"),
            ("rms", [evaluation.path_change_rms for evaluation in entry.evaluations], "dot"),
        ):
            change = {
                "x": numbers,
                "y": [max(UM * change, FLOOR_UM) for change in changes],
                "mode": "lines+markers",
                "name": f"path change, {name}",
                "legendgroup": f"path_change_{name}_m",
                "showlegend": count == 0,
                "line": {"color": DESIRED, "dash": dash, "width": 1.5},
            }
            traces.append(change)
        count += len(numbers)
        ends.append((count, UM * entry.deviation.maximum))
    corrections = {
        "x": [number for number, _ in ends],
        "y": [max(value, FLOOR_UM) for _, value in ends],
        "mode": "lines+markers",
        "name": "deviation from the desired path, max",
        "line": {"color": AFTER, "width": 3},
        "marker": {"size": 10},
    }
    across = {"title": "evaluation of the process", "dtick": max(count // 12, 1)}
    return drawn([*traces, corrections], 300, xaxis=across, yaxis=log_axis(title="[um]"))
