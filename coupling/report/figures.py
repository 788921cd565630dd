"""Figures of a run: plotly only."""

from __future__ import annotations

import numpy as np
import plotly.graph_objects as go
from plotly.subplots import make_subplots

from coupling.path.histories import ToolPath
from coupling.run.stored_run import StoredRobot, StoredRun, stages

# Colours that stay apart for colour-blind eyes (Okabe and Ito).
BEFORE, AFTER, DESIRED = "#D55E00", "#0072B2", "#333333"
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
                showlegend=entry["number"] == 0,
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
        distance = path.distance_to(run.desired)
        figure.add_scatter(
            x=path.time,
            y=np.maximum(_UM * distance, _FLOOR_UM),
            name=name,
            showlegend=True,
            line={"color": color},
            row=1,
            col=1,
        )
    first = next(iter(run.actual))
    difference = _UM * (run.uncompensated.position[0] - run.desired.position[0])
    for axis, color, values in zip("xyz", _AXES, difference.T, strict=True):
        figure.add_scatter(
            x=run.desired.time,
            y=values,
            name=f"{first}, {axis}",
            line={"color": color},
            row=2,
            col=1,
        )
    figure.update_yaxes(title="distance [um]", type="log", row=1, col=1)
    figure.update_yaxes(title=f"{first} [um]", row=2, col=1)
    figure.update_xaxes(title="time [s]", row=2, col=1)
    return style(figure, 560)


def wrench(run: StoredRobot) -> go.Figure:
    """Force and moment on the tool over time."""
    moments = bool(np.any(run.wrench.wrench[..., 3:]))
    figure = make_subplots(rows=1 + moments, cols=1, shared_xaxes=True)
    for k, (name, color) in enumerate(zip(("fx", "fy", "fz"), _AXES, strict=True)):
        figure.add_scatter(
            x=run.wrench.time,
            y=run.wrench.wrench[0, :, k],
            name=name,
            line={"color": color},
            row=1,
            col=1,
        )
        if moments:
            values = run.wrench.wrench[0, :, k + 3]
            line = {"color": color, "dash": "dot"}
            figure.add_scatter(
                x=run.wrench.time, y=values, name=f"m{'xyz'[k]}", line=line, row=2, col=1
            )
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

    def add(path: ToolPath, name: str, color: str, width: float) -> None:
        desired = run.desired.position[0]
        x, y, z = 1e3 * (desired + factor * (path.position[0] - desired)).T
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
        figure.add_scatter(x=time, y=1e3 * values, name=name, line={"color": color})
    commanded = 1e3 * cell.figures["pinch_gap_m"]["commanded"]
    figure.add_hline(y=commanded, line={"color": DESIRED, "dash": "dash", "width": 1})
    figure.update_yaxes(title="gap [mm]")
    figure.update_xaxes(title="time [s]")
    return style(figure)


def cell(stored: StoredRun) -> go.Figure:
    """Draw the desired paths of all tools in space."""
    figure = go.Figure()
    for (name, run), color in zip(stored.robots.items(), (AFTER, BEFORE), strict=False):
        x, y, z = 1e3 * run.desired.position[0].T
        line = {"color": color, "width": 2}
        figure.add_scatter3d(x=x, y=y, z=z, mode="lines", name=f"{name} tool", line=line)
    axes = {f"{axis}axis": {"title": f"{axis} [mm]"} for axis in "xyz"}
    figure.update_layout(scene={**axes, "aspectmode": "data"})
    return style(figure, 560)
