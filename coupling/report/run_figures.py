"""Figures along the path: how far the tool is off, and which gear reverses there."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
import plotly.graph_objects as go
from plotly.subplots import make_subplots

from coupling.report.colours import AFTER, BEFORE, DESIRED, GREEN, PLANT, QUIET
from coupling.report.run_tables import mode_names
from coupling.report.shares import spike
from coupling.report.style import (
    FLOOR_UM,
    UM,
    DrawnLine,
    curve,
    log_axis,
    over_time,
    shown_distance,
    style,
)
from coupling.results.run_result import ReversalResult
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
    shares = [height - below, below] if gears else [1.0]
    figure = make_subplots(
        rows=len(shares), cols=1, shared_xaxes=True, row_heights=shares, vertical_spacing=0.06
    )
    own, other = mode_names(run.figures.mode)
    for (stage, path), color in zip(run.actual.items(), _STAGES, strict=False):
        paths = [(f"{stage}, {own}", path, "solid", 1.5)]
        if stage in run.other:
            paths.append((f"{stage}, {other}", run.other[stage], "dot", 1.0))
        for name, drawn, dash, width in paths:
            line = {"color": color, "dash": dash, "width": width}
            points = curve(drawn.time, shown_distance(drawn.distance_to(run.desired)))
            figure.add_scatter(**points, name=name, mode="lines", line=line, row=1, col=1)
    if run.plant is not None:
        points = curve(run.plant.time, shown_distance(run.plant.distance_to(run.desired)))
        line = {"color": PLANT, "width": 1.5}
        figure.add_scatter(**points, name="on the plant", mode="lines", line=line, row=1, col=1)
    _label(figure, run, gears)
    if gears:
        _add_gears(figure, changes, gears)
    low, high = figure.layout.yaxis.range
    ticks = log_axis(title="distance [um]", **({"dtick": "D2"} if high - low < 2.0 else {}))
    figure.update_yaxes(ticks, row=1, col=1)
    figure.update_xaxes(title="time [s]", row=len(shares), col=1)
    return style(figure, height + 74)


def _label(figure: go.Figure, run: StoredRobot, gears: list[int]) -> None:
    """Name the gears at the largest spikes of their reversals, each in a row above the curves."""
    drawn = np.log10(np.concatenate([trace.y for trace in figure.data]))
    smallest, largest = float(drawn.min()), float(drawn.max())
    span = max(largest - smallest, 1.0)
    row = _LABEL * span / _CURVES
    top = largest + 0.05 * span
    ends = [smallest - 0.05 * span, top + row * (len(gears) + 0.3)]
    figure.update_yaxes(range=ends, row=1, col=1)
    # At once: one that is added alone has all before it checked again.
    figure.layout.annotations += tuple(
        go.layout.Annotation(
            x=time,
            y=np.log10(max(UM * distance, FLOOR_UM)),
            ax=time,
            ay=top + row * (number + 0.5),
            axref="x",
            ayref="y",
            text=f"joint {joint}",
            font={"size": 11},
            showarrow=True,
            arrowhead=6,
            arrowsize=0.6,
            arrowwidth=1,
            arrowcolor=QUIET,
            standoff=2,
        )
        for number, joint in enumerate(reversed(gears))
        for time, distance in labelled(run, joint)
    )


def labelled(run: StoredRobot, joint: int) -> list[tuple[float, float]]:
    """Return times [s] and heights [m] of the largest spikes where a gear reverses."""
    *_, path = run.actual.values()
    distance = path.distance_to(run.desired)
    own = [c for c in run.figures.reversals if c.joint == joint]
    spikes = sorted((spike(path.time, distance, change) for change in own), key=lambda s: -s[1])
    apart = _APART * float(np.ptp(path.time))
    found: list[tuple[float, float]] = []
    for time, height in spikes:
        if len(found) < _LABELS and all(abs(time - other) > apart for other, _ in found):
            found.append((time, height))
    return found


def _add_gears(figure: go.Figure, changes: Sequence[ReversalResult], gears: list[int]) -> None:
    """Add when which gear is in its backlash, and which flank it reaches."""
    rows = {joint: number for number, joint in enumerate(gears)}
    figure.add_scatter(
        x=[time for c in changes for time in (c.begins_s, c.ends_s, None)],
        y=[rows[c.joint] for c in changes for _ in range(3)],
        mode="lines",
        name="gear in its backlash",
        line={"color": QUIET, "width": 6},
        hoverinfo="skip",
        row=2,
        col=1,
    )
    for side, symbol, color in ((1, "triangle-up", BEFORE), (-1, "triangle-down", AFTER)):
        own = [c for c in changes if c.after == side]
        figure.add_scatter(
            x=[c.ends_s for c in own],
            y=[rows[c.joint] for c in own],
            mode="markers",
            name=f"reaches its {'upper' if side > 0 else 'lower'} flank",
            marker={"symbol": symbol, "color": color, "size": 7},
            text=[_hint(c) for c in own],
            hoverinfo="text",
            row=2,
            col=1,
        )
    figure.update_yaxes(
        tickvals=list(rows.values()),
        ticktext=[f"joint {joint}" for joint in gears],
        range=[-0.7, len(gears) - 0.3],
        zeroline=False,
        row=2,
        col=1,
    )


def _hint(change: ReversalResult) -> str:
    return f"joint {change.joint}, {change.begins_s:.4f} to {change.ends_s:.4f} s"


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
    figure = make_subplots(rows=1 + moments, cols=1, shared_xaxes=True, vertical_spacing=0.08)
    for k, (axis, color) in enumerate(zip("xyz", (AFTER, GREEN, BEFORE), strict=True)):
        for row, letter in enumerate("fm"[: 1 + moments]):
            points = curve(run.wrench.time, run.wrench.wrench[0, :, k + 3 * row])
            line = {"color": color, "width": 1.5, "dash": ("solid", "dot")[row]}
            name = f"{letter}{axis}"
            figure.add_scatter(**points, name=name, mode="lines", line=line, row=row + 1, col=1)
    figure.update_yaxes(title="force [N]", row=1, col=1)
    if moments:
        figure.update_yaxes(title="moment [N m]", row=2, col=1)
    figure.update_xaxes(title="time [s]", row=1 + moments, col=1)
    return style(figure, 300 + 180 * moments)


def convergence(run: StoredRobot) -> go.Figure:
    """Path change of every process evaluation and deviation of every iteration, logarithmic."""
    figure = go.Figure()
    count = 0
    ends: list[tuple[int, float]] = []
    for entry in run.figures.iterations:
        numbers = [count + k + 1 for k in range(len(entry.evaluations))]
        for name, changes, dash in (
            ("max", [own.path_change_max_m for own in entry.evaluations], "solid"),
            ("rms", [own.path_change_rms_m for own in entry.evaluations], "dot"),
        ):
            figure.add_scatter(
                x=numbers,
                y=[max(UM * change, FLOOR_UM) for change in changes],
                mode="lines+markers",
                name=f"path change, {name}",
                legendgroup=f"path_change_{name}_m",
                showlegend=count == 0,
                line={"color": DESIRED, "dash": dash, "width": 1.5},
            )
        count += len(numbers)
        ends.append((count, UM * entry.deviation_m.maximum))
    figure.add_scatter(
        x=[number for number, _ in ends],
        y=[max(value, FLOOR_UM) for _, value in ends],
        mode="lines+markers",
        name="deviation from the desired path, max",
        line={"color": AFTER, "width": 3},
        marker={"size": 10},
    )
    figure.update_xaxes(title="evaluation of the process", dtick=max(count // 12, 1))
    figure.update_yaxes(log_axis(title="[um]"))
    return style(figure, 300)
