"""Figures of the comparison of implementations."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np
import plotly.graph_objects as go

from coupling.path.frame import Frame
from coupling.path.histories import ToolPath
from examples.compare_implementations import CURVES, Both

# Colours that stay apart for colour-blind eyes (Okabe and Ito).
RIGID, OTHER = "#333333", "#777777"
COLORS = {"linear": "#0072B2", "backlash": "#D55E00", "spline": "#009E73"}
# Curves that lie close to each other stay visible when the last one is dashed.
_DASHES = {"linear": "solid", "backlash": "solid", "spline": "6px,4px"}
_MM = 1e3
# Distances below this [m] are rounding; the logarithmic axis ends there.
_ROUNDING = 1e-15


@dataclass(frozen=True)
class Window:
    """A square part of the path's plane.

    Attributes:
        name: Letter in the pictures.
        x, y: Centre [m].
        half: Half side [m].
    """

    name: str
    x: float
    y: float
    half: float


def in_plane(
    paths: Mapping[str, Both], desired: ToolPath, part: Frame, window: Window, size: int
) -> go.Figure:
    """Draw the paths of our implementation in the plane of the part, equal axes.

    Args:
        paths: By torque curve.
        desired: The rigid robot's path.
        part: Its plane.
        window: What is shown.
        size: Width and height of the figure [px].
    """
    figure = go.Figure()
    x, y = _MM * part.coordinates(desired.position[0])[:, :2].T
    figure.add_scatter(x=x, y=y, name="rigid", line={"color": RIGID, "width": 1.5})
    for curve, both in paths.items():
        x, y = _MM * part.coordinates(both.ours.position[0])[:, :2].T
        line = {"color": COLORS[curve], "dash": _DASHES[curve], "width": 2}
        figure.add_scatter(x=x, y=y, name=CURVES[curve], line=line)
    x, y, half = _MM * window.x, _MM * window.y, _MM * window.half
    figure.update_xaxes(title="x in the plane, downhill [mm]", range=[x - half, x + half])
    figure.update_yaxes(title="y [mm]", range=[y - half, y + half], scaleanchor="x")
    return _styled(figure, size, size + 40)


def mark(figure: go.Figure, window: Window) -> None:
    """Draw where a window is; a small one is drawn larger than it is."""
    half = _MM * max(window.half, 8e-3)
    x, y = _MM * window.x, _MM * window.y
    line = {"color": RIGID, "width": 1.2}
    figure.add_shape(x0=x - half, x1=x + half, y0=y - half, y1=y + half, line=line)
    figure.add_annotation(
        x=x - half, y=y, text=f"<b>{window.name}</b>", xanchor="right", showarrow=False
    )


def mark_mujoco(
    figure: go.Figure, paths: Mapping[str, Both], part: Frame, window: Window, every: int
) -> None:
    """Add MuJoCo's tool at every so many samples inside a window."""
    name = "circles: MuJoCo"
    for curve, both in paths.items():
        points = part.coordinates(both.mujoco.position[0])[::every, :2]
        inside = np.abs(points - [window.x, window.y]).max(axis=1) < window.half
        x, y = _MM * points[inside].T
        marker = {"color": COLORS[curve], "symbol": "circle-open", "size": 8}
        figure.add_scatter(x=x, y=y, mode="markers", marker=marker, name=name, showlegend=False)
    marker = {"color": OTHER, "symbol": "circle-open", "size": 8}
    figure.add_scatter(x=[None], y=[None], mode="markers", marker=marker, name=name)


def differences(paths: Mapping[str, Both]) -> go.Figure:
    """Distance between the implementations over time, logarithmic."""
    figure = go.Figure()
    for curve, both in paths.items():
        distance = np.maximum(both.distance, _ROUNDING)
        line = {"color": COLORS[curve], "width": 1.3}
        figure.add_scatter(x=both.ours.time, y=distance, name=CURVES[curve], line=line)
    figure.update_xaxes(title="time [s]")
    figure.update_yaxes(
        title="distance of the two tools [m]", type="log", dtick=2, exponentformat="power"
    )
    return _styled(figure, 1000, 360)


def released(falls: Mapping[str, Both], until: float) -> go.Figure:
    """Height of the tool over time after the release, up to a time [s]; circles are MuJoCo's."""
    figure = go.Figure()
    for curve, both in falls.items():
        shown = both.ours.time <= until
        start = both.ours.position[0, 0, 2]
        height = _MM * (both.ours.position[0, shown, 2] - start)
        line = {"color": COLORS[curve], "dash": _DASHES[curve], "width": 1.8}
        figure.add_scatter(x=both.ours.time[shown], y=height, name=CURVES[curve], line=line)
        time, other = both.mujoco.time[shown][::8], both.mujoco.position[0, shown, 2][::8]
        marker = {"color": COLORS[curve], "symbol": "circle-open", "size": 6}
        figure.add_scatter(
            x=time, y=_MM * (other - start), mode="markers", marker=marker, showlegend=False
        )
    figure.update_xaxes(title="time [s]")
    figure.update_yaxes(title="height [mm]")
    return _styled(figure, 1000, 360)


def _styled(figure: go.Figure, width: int, height: int) -> go.Figure:
    figure.update_layout(
        template="plotly_white",
        width=width,
        height=height,
        font={"family": "DejaVu Sans, sans-serif", "size": 13},
        margin={"l": 75, "r": 20, "t": 40, "b": 55},
        legend={"orientation": "h", "y": 1.01, "yanchor": "bottom", "x": 0.0},
    )
    axis = {"showline": True, "linecolor": "#888888", "mirror": True, "zeroline": False}
    figure.update_xaxes(constrain="domain", **axis)
    figure.update_yaxes(constrain="domain", **axis)
    return figure
