"""Views of the part and of the robots at it, as a drawing shows them."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
import plotly.graph_objects as go

from coupling.path.frame import Frame
from coupling.path.histories import ToolPath
from coupling.report.colours import AFTER, BEFORE, DESIRED, QUIET
from coupling.report.style import FLOOR_UM, Keys, decades, drawn
from coupling.report.thinning import extremes
from coupling.results.run_result import RobotResult
from coupling.results.section import UM

# Points of a path in a view, and parts of its time of which the extremes are among them.
_POINTS, _PARTS = 4000, 500
# Decades of the colours at most.
_DECADES = 5
# Light enough for dark ground, dark enough for light one.
_SCALE = (0.0, 0.5, 1.0), ((63, 200, 184), (155, 154, 36), (220, 28, 59))
_COLOURS = 20
# Width that a view has, and its height at most, and what its bar of colours needs [px].
_WIDTH, _HIGHEST, _BAR = 420, 380, 70
# Smallest extent of a view, as a part of the larger one.
_LEAST = 0.3


def rows_in_space(time: np.ndarray, *peaks: np.ndarray) -> np.ndarray:
    """Return the numbers of rows to draw of paths in space: even ones, and where `peaks` are extreme.

    Args:
        time: Rising times [s], (n,).
        peaks: Values whose extremes are drawn, any unit, (n,) each.
    """
    even = np.linspace(0, len(time) - 1, _POINTS).astype(int)
    return np.unique(np.concatenate([even, *(extremes(time, values, _PARTS) for values in peaks)]))


@dataclass(frozen=True)
class PathView:
    """A path to be seen from above.

    Attributes:
        title: Title of the view.
        desired, actual: Desired and actual path of its tool, at the same times.
        part: Placement of the part in the world, by the keys of [part].
    """

    title: str
    desired: ToolPath
    actual: ToolPath
    part: Mapping[str, Any]

    @property
    def in_part(self) -> np.ndarray:
        """Desired positions in the part [mm], (n, 3)."""
        part = Frame.of_rpy(self.part["position_m"], np.deg2rad(self.part["rpy_deg"]))
        return 1e3 * part.coordinates(self.desired.position[0])

    @property
    def logarithms(self) -> np.ndarray:
        """Decimal logarithms of the deviation [um], (n,)."""
        distance = self.actual.distance_to(self.desired)
        return np.log10(np.maximum(UM * distance, FLOOR_UM))


def from_above(views: Sequence[PathView]) -> tuple[go.Figure, ...]:
    """Draw paths along their part's z axis, coloured by deviation, all on one scale."""
    logs = [view.logarithms for view in views]
    high = max(float(values.max()) for values in logs)
    low = max(min(float(values.min()) for values in logs), high - _DECADES)
    scale = min(low, high - 1.0), high
    return tuple(_coloured(view, values, scale) for view, values in zip(views, logs, strict=True))


def _coloured(view: PathView, values: np.ndarray, scale: tuple[float, float]) -> go.Figure:
    """Draw one path from above, coloured by the decimal logarithms of its deviation in um."""
    traces: list[Keys] = []
    rows = rows_in_space(view.desired.time, values)
    x, y, _ = view.in_part.T
    # A piece between two rows is as bad as its worse end; the worst are drawn last, and so on top.
    worse = np.maximum(values[rows[:-1]], values[rows[1:]])
    ends = np.linspace(*scale, _COLOURS + 1)
    number = np.clip(np.searchsorted(ends, worse, side="right") - 1, 0, _COLOURS - 1)
    for k in np.unique(number):
        indices = np.flatnonzero(number == k)
        begin, gap = np.flatnonzero(np.diff(indices, prepend=-2) > 1)[1:], np.nan
        across, up = (
            np.concatenate([_with_end(v[rows], run, gap) for run in np.split(indices, begin)])
            for v in (x, y)
        )
        piece = {
            "x": across,
            "y": up,
            "mode": "lines",
            "showlegend": False,
            "name": f"{10.0 ** ends[k]:.2g} to {10.0 ** ends[k + 1]:.2g} um",
            "line": {"color": _colour((k + 0.5) / _COLOURS), "width": 2.5},
            "hovertemplate": "x %{x:.1f} mm, y %{y:.1f} mm",
        }
        traces.append(piece)
    labels = ("x in the part [mm]", "y in the part [mm]")
    return _as_drawn(traces, view.title, labels, (x, y), scale)


def _bar(scale: tuple[float, float], height: float) -> Keys:
    """Return the bar of colours below a view of a height [px]."""
    return {
        "x": [None],
        "y": [None],
        "mode": "markers",
        "showlegend": False,
        "marker": {
            "color": [scale[0]],
            "cmin": scale[0],
            "cmax": scale[1],
            "colorscale": [[k / 10, _colour(k / 10)] for k in range(11)],
            "showscale": True,
            "colorbar": {
                "title": {"text": "deviation [um]", "side": "bottom"},
                "orientation": "h",
                "thickness": 12,
                "len": 1.0,
                "y": -56.0 / height,
                "yanchor": "top",
                **decades(*scale),
            },
        },
    }


def _with_end(values: np.ndarray, pieces: np.ndarray, gap: float) -> np.ndarray:
    """Return the ends of neighbouring pieces of a line, and a gap behind them."""
    return np.concatenate([values[pieces[0] : pieces[-1] + 2], [gap]])


def _colour(part: float) -> str:
    """Return the colour of a part of the scale from 0 to 1."""
    rgb = [np.interp(part, _SCALE[0], channel) for channel in _SCALE[1]]
    return f"rgb({', '.join(str(round(value)) for value in rgb)})"


def _as_drawn(
    traces: list[Keys],
    title: str,
    labels: tuple[str, str],
    points: tuple[np.ndarray, np.ndarray],
    colours: tuple[float, float] | None = None,
) -> go.Figure:
    """Return a view with one scale on both axes, a title, a height that suits, and a bar of `colours`.

    What is narrower than a part of the other extent gets that much.
    """
    extents = [float(np.ptp(v)) for v in points]
    least = _LEAST * max(*extents, 1e-9)
    spans = [1.1 * max(extent, least) for extent in extents]
    middle = [0.5 * (v.min() + v.max()) for v in points]
    ends = [[m - 0.5 * s, m + 0.5 * s] for m, s in zip(middle, spans, strict=True)]
    height = min(_WIDTH * spans[1] / spans[0], _HIGHEST)
    x, y = (
        {"title": label, "range": end, "constrain": "domain", "zeroline": False}
        for label, end in zip(labels, ends, strict=True)
    )
    bars, below = ([], 0) if colours is None else ([_bar(colours, height)], _BAR)
    return drawn(
        [*traces, *bars],
        int(height) + 74 + below,
        margin={"b": 46 + below},
        xaxis=x,
        yaxis={**y, "scaleanchor": "x"},
        title={"text": title, "font": {"size": 14}, "x": 0.5, "y": 0.985},
    )


def robot_views(
    robots: Sequence[RobotResult], paths: Sequence[ToolPath]
) -> tuple[go.Figure, go.Figure]:
    """Draw robots as links at their paths: from the side and from above, world frame.

    Args:
        robots: Their figures.
        paths: Desired paths of their tools.
    """
    chains = [np.array(robot.links_m) for robot in robots]
    tools = [path.position[0, rows_in_space(path.time)] for path in paths]
    away = tools[0].mean(axis=0)[:2] - chains[0][0, :2]
    length = float(np.linalg.norm(away))
    radial = np.append(away / length if length > 1e-6 else [1.0, 0.0], 0.0)
    side = np.array([radial, [0.0, 0.0, 1.0]])
    above = np.array([[1.0, 0.0, 0.0], [0.0, 1.0, 0.0]])
    names = [robot.name for robot in robots]
    return (
        _project("from the side", side, ("outwards [m]", "z [m]"), names, chains, tools),
        _project("from above", above, ("x [m]", "y [m]"), names, chains, tools),
    )


def _project(
    title: str,
    axes: np.ndarray,
    labels: tuple[str, str],
    names: Sequence[str],
    chains: Sequence[np.ndarray],
    tools: Sequence[np.ndarray],
) -> go.Figure:
    """Draw what is seen along two axes, (2, 3)."""
    traces: list[Keys] = []
    points = []
    for name, chain, tool, color in zip(names, chains, tools, (DESIRED, QUIET), strict=False):
        links, path = axes @ chain.T, axes @ tool.T
        points += [links, path]
        words = "robot" if len(names) == 1 else f"{name} robot"
        robot = {
            "x": links[0],
            "y": links[1],
            "mode": "lines+markers",
            "name": words,
            "line": {"color": color, "width": 7},
            "marker": {"color": AFTER, "size": 10, "line": {"width": 0}},
            "text": ["base", *(f"joint {k + 1}" for k in range(len(chain) - 2)), "TCP"],
            "hovertemplate": "%{text}<extra></extra>",
        }
        desired = {
            "x": path[0],
            "y": path[1],
            "mode": "lines",
            "name": "desired path" if len(names) == 1 else f"desired path of its tool, {name}",
            "line": {"color": BEFORE, "width": 1.5},
            "hoverinfo": "skip",
        }
        traces += [robot, desired]
    x, y = np.hstack(points)
    return _as_drawn(traces, title, labels, (x, y))
