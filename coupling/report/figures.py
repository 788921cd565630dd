"""Figures of a run: plotly only."""

from __future__ import annotations

from typing import Any

import numpy as np
import plotly.graph_objects as go
from plotly.subplots import make_subplots

from coupling.path.histories import ToolPath
from coupling.report.thinning import PARTS, extremes
from coupling.run.stored_run import StoredRobot, StoredRun, stages

# Colours that stay apart for colour-blind eyes (Okabe and Ito).
BEFORE, AFTER, DESIRED = "#D55E00", "#0072B2", "#333333"
PLANT = "#CC79A7"
_AXES = ("#0072B2", "#009E73", "#D55E00")
_UM = 1e6
# Smallest distance shown on a logarithmic axis [um]; a nanometre is below every figure of interest.
_FLOOR_UM = 1e-3


def style(figure: go.Figure, height: int = 380) -> go.Figure:
    """Give a figure the report's look."""
    figure.update_layout(
        template="plotly_white",
        height=height,
        margin={"l": 70, "r": 20, "t": 60, "b": 50},
        legend={"orientation": "h", "y": 1.02, "yanchor": "bottom"},
        font={"family": "system-ui, sans-serif", "size": 13},
    )
    return figure


def _curve(time: np.ndarray, values: np.ndarray) -> dict[str, np.ndarray]:
    """Return the points to draw of a curve over time."""
    rows = extremes(time, values)
    return {"x": time[rows], "y": values[rows]}


def _rows_in_space(time: np.ndarray, *peaks: np.ndarray) -> np.ndarray:
    """Return the rows to draw of paths in space: evenly spaced ones, and where `peaks` are extreme."""
    even = np.arange(0, len(time), max(len(time) // PARTS, 1))
    return np.unique(np.concatenate([even, *(extremes(time, values) for values in peaks)]))


def convergence(run: StoredRobot) -> go.Figure:
    """Path change of every process evaluation and deviation of every pass, logarithmic."""
    figure = go.Figure()
    count = 0
    ends: list[tuple[int, float]] = []
    for entry in run.figures["passes"]:
        numbers = [count + k + 1 for k in range(len(entry["evaluations"]))]
        for key, name, dash in (
            ("path_change_max_m", "path change, max", "solid"),
            ("path_change_rms_m", "path change, rms", "dot"),
        ):
            values = [max(_UM * e[key], _FLOOR_UM) for e in entry["evaluations"]]
            figure.add_scatter(
                x=numbers,
                y=values,
                mode="lines+markers",
                name=name,
                legendgroup=key,
                showlegend=count == 0,
                line={"color": DESIRED, "dash": dash},
            )
        count = numbers[-1]
        ends.append((count, _UM * entry["deviation_m"]["maximum"]))
    figure.add_scatter(
        x=[number for number, _ in ends],
        y=[max(value, _FLOOR_UM) for _, value in ends],
        mode="lines+markers",
        name="deviation from the desired path, max",
        line={"color": AFTER, "width": 3},
        marker={"size": 10},
    )
    figure.update_xaxes(title="evaluation of the process", dtick=1)
    figure.update_yaxes(title="um", type="log")
    return style(figure)


def deviation(run: StoredRobot) -> go.Figure:
    """Distance of the actual paths to the desired one over time, and its components at first."""
    figure = make_subplots(rows=2, cols=1, shared_xaxes=True, vertical_spacing=0.08)
    for (name, path), color in zip(run.actual.items(), (BEFORE, AFTER), strict=False):
        figure.add_scatter(
            **_curve(path.time, np.maximum(_UM * path.distance_to(run.desired), _FLOOR_UM)),
            name=name,
            showlegend=True,
            line={"color": color},
            row=1,
            col=1,
        )
    if run.plant is not None:
        figure.add_scatter(
            **_curve(run.plant.time, _UM * run.plant.distance_to(run.desired)),
            name="on the plant",
            line={"color": PLANT},
            row=1,
            col=1,
        )
    if run.figures["flank_changes"]:
        figure.add_scatter(**_reached(run), row=1, col=1)
    first = next(iter(run.actual))
    difference = _UM * (run.uncompensated.position[0] - run.desired.position[0])
    for axis, color, values in zip("xyz", _AXES, difference.T, strict=True):
        figure.add_scatter(
            **_curve(run.desired.time, values),
            name=f"{first}, {axis}",
            line={"color": color},
            row=2,
            col=1,
        )
    figure.update_yaxes(title="distance [um]", type="log", row=1, col=1)
    figure.update_yaxes(title=f"{first} [um]", row=2, col=1)
    figure.update_xaxes(title="time [s]", row=2, col=1)
    style(figure, 590).update_layout(margin_t=90)  # two lines of names
    return figure


def flanks(run: StoredRobot) -> go.Figure:
    """Passages of gears through their play over time."""
    figure = go.Figure()
    changes = run.figures["flank_changes"]
    bars = [(c["begins_s"], c["ends_s"], None) for c in changes]
    figure.add_scatter(
        x=[time for bar in bars for time in bar],
        y=[c["joint"] for c in changes for _ in range(3)],
        mode="lines",
        name="in its play",
        line={"color": "#999999", "width": 6},
        hoverinfo="skip",
    )
    for side, symbol, color in ((1, "triangle-up", BEFORE), (-1, "triangle-down", AFTER)):
        own = [c for c in changes if c["after"] == side]
        figure.add_scatter(
            x=[c["ends_s"] for c in own],
            y=[c["joint"] for c in own],
            mode="markers",
            name=f"reaches its {'upper' if side > 0 else 'lower'} flank",
            marker={"symbol": symbol, "color": color, "size": 8},
            text=[_hint(c) for c in own],
            hoverinfo="text",
        )
    joints = {c["joint"] for c in changes}
    span = [min(joints) - 0.6, max(joints) + 0.6]
    figure.update_yaxes(dtick=1, tickprefix="joint ", range=span)
    figure.update_xaxes(title="time [s]")
    return style(figure, 200 + 40 * (max(joints) - min(joints)))


def _reached(run: StoredRobot) -> dict[str, Any]:
    """Return the marks of gears that reach a flank, on the last of the actual paths."""
    changes = run.figures["flank_changes"]
    *_, path = run.actual.values()
    times = [c["ends_s"] for c in changes]
    distance = _UM * np.interp(times, path.time, path.distance_to(run.desired))
    return {
        "x": times,
        "y": np.maximum(distance, _FLOOR_UM),
        "mode": "markers",
        "name": "a gear reaches a flank",
        "marker": {"symbol": "x-thin", "size": 7, "line": {"width": 1.5, "color": DESIRED}},
        "text": [_hint(c) for c in changes],
        "hoverinfo": "text",
    }


def _hint(change: dict[str, Any]) -> str:
    return f"joint {change['joint']}, {change['begins_s']:.4f} to {change['ends_s']:.4f} s"


def wrench(run: StoredRobot) -> go.Figure:
    """Force and moment on the tool over time."""
    moments = bool(np.any(run.wrench.wrench[..., 3:]))
    figure = make_subplots(rows=1 + moments, cols=1, shared_xaxes=True)
    for k, (name, color) in enumerate(zip(("fx", "fy", "fz"), _AXES, strict=True)):
        figure.add_scatter(
            **_curve(run.wrench.time, run.wrench.wrench[0, :, k]),
            name=name,
            line={"color": color},
            row=1,
            col=1,
        )
        if moments:
            curve = _curve(run.wrench.time, run.wrench.wrench[0, :, k + 3])
            line = {"color": color, "dash": "dot"}
            figure.add_scatter(**curve, name=f"m{'xyz'[k]}", line=line, row=2, col=1)
    figure.update_yaxes(title="force on the tool [N]", row=1, col=1)
    if moments:
        figure.update_yaxes(title="moment [N m]", row=2, col=1)
    figure.update_xaxes(title="time [s]", row=1 + moments, col=1)
    return style(figure)


def amplification(run: StoredRobot) -> int:
    """Return a round factor that makes the first deviation about a tenth of the path's size."""
    largest = run.uncompensated.distance_to(run.desired).max()
    size = np.ptp(run.desired.position[0], axis=0).max()
    if largest == 0.0:
        return 1
    factor = max(0.1 * size / largest, 1.0)
    digit = 10.0 ** np.floor(np.log10(factor))
    return int(digit * max(d for d in (1, 2, 5) if d * digit <= factor))


def paths(run: StoredRobot, factor: int) -> go.Figure:
    """Draw the desired path and the actual ones in space, deviations amplified."""
    figure = go.Figure()
    distances = [path.distance_to(run.desired) for path in run.actual.values()]
    rows = _rows_in_space(run.desired.time, *distances)

    def add(path: ToolPath, name: str, color: str, width: float) -> None:
        desired = run.desired.position[0, rows]
        x, y, z = 1e3 * (desired + factor * (path.position[0, rows] - desired)).T
        figure.add_scatter3d(
            x=x, y=y, z=z, mode="lines", name=name, line={"color": color, "width": width}
        )

    add(run.desired, "desired", DESIRED, 2)
    for (name, path), color in zip(run.actual.items(), (BEFORE, AFTER), strict=False):
        add(path, f"{name}, deviation x {factor}", color, 3)
    axes = {f"{axis}axis": {"title": f"{axis} [mm]"} for axis in "xyz"}
    figure.update_layout(scene={**axes, "aspectmode": "data"})
    return style(figure, 620)


def gap(cell: StoredRun) -> go.Figure:
    """Gap between the tools of a cell over time, actual and as commanded."""
    figure = go.Figure()
    assert cell.gap is not None
    time = cell.first.desired.time
    for values, name, color in zip(cell.gap.T, stages(cell.figures), (BEFORE, AFTER), strict=False):
        figure.add_scatter(**_curve(time, 1e3 * values), name=name, line={"color": color})
    commanded = 1e3 * cell.figures["pinch_gap_m"]["commanded"]
    figure.add_hline(y=commanded, line={"color": DESIRED, "dash": "dash", "width": 1})
    figure.update_yaxes(title="gap [mm]")
    figure.update_xaxes(title="time [s]")
    return style(figure)


def cell(stored: StoredRun) -> go.Figure:
    """Draw the desired paths of all tools in space."""
    figure = go.Figure()
    for (name, run), color in zip(stored.robots.items(), (AFTER, BEFORE), strict=False):
        path = run.desired
        rows = _rows_in_space(path.time, np.linalg.norm(path.position[0], axis=1))
        x, y, z = 1e3 * path.position[0, rows].T
        line = {"color": color, "width": 2}
        figure.add_scatter3d(x=x, y=y, z=z, mode="lines", name=f"{name} tool", line=line)
    axes = {f"{axis}axis": {"title": f"{axis} [mm]"} for axis in "xyz"}
    figure.update_layout(scene={**axes, "aspectmode": "data"})
    return style(figure, 560)
