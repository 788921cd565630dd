"""Views of the part and of the robots at it, as a drawing shows them."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np
import plotly.graph_objects as go
from scipy.spatial.transform import Rotation

from coupling.path.histories import ToolPath
from coupling.report.colours import AFTER, BEFORE, DESIRED, QUIET
from coupling.report.style import FLOOR_UM, UM, decades, style
from coupling.report.thinning import extremes
from coupling.run.stored_run import StoredRobot

# Points of a path in a view, and parts of its time of which the extremes are among them.
_POINTS, _PARTS = 900, 300
# Decades of the colours at most.
_DECADES = 5
# Light enough for dark ground, dark enough for light one.
_SCALE = [[0.0, "#3f9bdc"], [0.5, "#c89a1c"], [1.0, "#b8243b"]]


def rows_in_space(time: np.ndarray, *peaks: np.ndarray) -> np.ndarray:
    """Return the rows to draw of paths in space: evenly spaced ones, and where `peaks` are extreme."""
    even = np.linspace(0, len(time) - 1, _POINTS).astype(int)
    return np.unique(np.concatenate([even, *(extremes(time, values, _PARTS) for values in peaks)]))


def from_above(run: StoredRobot, part: Mapping[str, Any]) -> tuple[go.Figure, ...]:
    """Draw the path along the part's z axis, coloured by deviation: a figure for each stage, one scale.

    Args:
        run: The run.
        part: Table [part] of its case.
    """
    logs = {
        stage: np.log10(np.maximum(UM * path.distance_to(run.desired), FLOOR_UM))
        for stage, path in run.actual.items()
    }
    high = max(float(values.max()) for values in logs.values())
    low = max(min(float(values.min()) for values in logs.values()), high - _DECADES)
    low = min(low, high - 1.0)
    part_from_world = Rotation.from_euler("xyz", part["rpy_deg"], degrees=True).inv()
    x, y, _ = 1e3 * part_from_world.apply(run.desired.position[0] - part["position_m"]).T
    rows = rows_in_space(run.desired.time, *logs.values())
    return tuple(_coloured(stage, x, y, values, rows, (low, high)) for stage, values in logs.items())


def _coloured(
    stage: str,
    x: np.ndarray,
    y: np.ndarray,
    values: np.ndarray,
    rows: np.ndarray,
    scale: tuple[float, float],
) -> go.Figure:
    """Draw one path from above, coloured by the decimal logarithms of its deviation in um."""
    # The largest deviations are drawn last, and so on top.
    rows = rows[np.argsort(values[rows], kind="stable")]
    figure = go.Figure()
    figure.add_scatter(
        x=x[rows],
        y=y[rows],
        mode="markers",
        showlegend=False,
        marker={
            "size": 5,
            "color": values[rows],
            "cmin": scale[0],
            "cmax": scale[1],
            "colorscale": _SCALE,
            "colorbar": {
                "title": {"text": "deviation [um]", "side": "bottom"},
                "orientation": "h",
                "thickness": 12,
                "len": 1.0,
                "y": -0.22,
                "yanchor": "top",
                **decades(*scale),
            },
        },
        text=[f"{10.0**value:.3g} um" for value in values[rows]],
        hovertemplate="x %{x:.1f} mm, y %{y:.1f} mm: %{text}<extra></extra>",
    )
    figure.update_layout(title={"text": stage, "font": {"size": 14}, "x": 0.5, "y": 0.985})
    _as_drawn(figure, "x in the part [mm]", "y in the part [mm]", x, y)
    return style(figure, 480).update_layout(margin_b=110)


def _as_drawn(
    figure: go.Figure, across: str, up: str, x: np.ndarray, y: np.ndarray, least: float = 0.3
) -> None:
    """Give both axes one scale; what is narrower than `least` of the other extent gets that much."""
    middle = [0.5 * (v.min() + v.max()) for v in (x, y)]
    extents = [float(np.ptp(v)) for v in (x, y)]
    whole = max(*extents, 1e-9)
    spans = [1.1 * max(extent, least * whole) for extent in extents]
    ends = [[m - 0.5 * s, m + 0.5 * s] for m, s in zip(middle, spans, strict=True)]
    figure.update_xaxes(title=across, range=ends[0], constrain="domain", zeroline=False)
    figure.update_yaxes(
        title=up, range=ends[1], scaleanchor="x", constrain="domain", zeroline=False
    )


def robot_views(
    robots: Sequence[Mapping[str, Any]], paths: Sequence[ToolPath]
) -> tuple[go.Figure, go.Figure]:
    """Draw robots as links at their paths: from the side and from above, world frame.

    Args:
        robots: `robots` of result.json.
        paths: Desired paths of their tools.
    """
    chains = [np.array(robot["links_m"]) for robot in robots]
    tools = [path.position[0, rows_in_space(path.time)] for path in paths]
    away = tools[0].mean(axis=0)[:2] - chains[0][0, :2]
    length = float(np.linalg.norm(away))
    radial = np.append(away / length if length > 1e-6 else [1.0, 0.0], 0.0)
    side = np.array([radial, [0.0, 0.0, 1.0]])
    above = np.array([[1.0, 0.0, 0.0], [0.0, 1.0, 0.0]])
    names = [str(robot["name"]) for robot in robots]
    return (
        _seen("from the side", side, ("outwards [m]", "z [m]"), names, chains, tools),
        _seen("from above", above, ("x [m]", "y [m]"), names, chains, tools),
    )


def _seen(
    title: str,
    axes: np.ndarray,
    labels: tuple[str, str],
    names: Sequence[str],
    chains: Sequence[np.ndarray],
    tools: Sequence[np.ndarray],
) -> go.Figure:
    """Draw what is seen along two axes, (2, 3)."""
    figure = go.Figure()
    points = []
    for name, chain, tool, color in zip(names, chains, tools, (DESIRED, QUIET), strict=False):
        links, path = axes @ chain.T, axes @ tool.T
        points += [links, path]
        words = "robot" if len(names) == 1 else f"{name} robot"
        figure.add_scatter(
            x=links[0],
            y=links[1],
            mode="lines+markers",
            name=words,
            line={"color": color, "width": 7},
            marker={"color": AFTER, "size": 10, "line": {"width": 0}},
            text=["base", *(f"joint {k + 1}" for k in range(len(chain) - 2)), "TCP"],
            hovertemplate="%{text}<extra></extra>",
        )
        figure.add_scatter(
            x=path[0],
            y=path[1],
            mode="lines",
            name="desired path" if len(names) == 1 else f"desired path of its tool, {name}",
            line={"color": BEFORE, "width": 1.5},
            hoverinfo="skip",
        )
    x, y = np.hstack(points)
    figure.update_layout(title={"text": title, "font": {"size": 14}, "x": 0.5, "y": 0.985})
    _as_drawn(figure, *labels, x, y)
    return style(figure, 400)
