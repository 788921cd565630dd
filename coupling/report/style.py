"""The look that all figures of the reports share; the page's script adds light and dark."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from typing import Any, NamedTuple

import numpy as np
import plotly.graph_objects as go

from coupling.report.thinning import PARTS, extremes

# Smallest distance shown on a logarithmic axis [um]; a nanometre is below every figure of interest.
FLOOR_UM = 1e-3
# Keys of a trace, an axis or another part of a figure, as plotly.js has them.
Keys = Mapping[str, Any]
_LOOK: dict[str, Any] = {
    "template": "none",
    "margin": {"l": 64, "r": 16, "t": 28, "b": 46},
    "showlegend": False,
    "font": {"family": "system-ui, sans-serif", "size": 12},
}


def drawn(
    traces: Sequence[Keys], height: int = 380, *, margin: Keys | None = None, **layout: Any
) -> go.Figure:
    """Return a figure in the reports' look; its legend is the page's.

    It is made at once: plotly checks all of a figure again with each part that is added or changed.

    Args:
        traces: Curves and so on by the keys of plotly.js; without a `type` a curve or points.
        height: Height [px].
        margin: Sides whose margin is another one [px].
        layout: Axes and other keys of the layout.
    """
    for name in layout:
        if name.startswith(("xaxis", "yaxis")):
            layout[name] = {"automargin": True, **layout[name]}
    sides = {**_LOOK["margin"], **(margin or {})}
    whole = {**_LOOK, "height": height, "margin": sides, **layout}
    return go.Figure({"data": list(traces), "layout": whole})


def style(figure: go.Figure, height: int = 380) -> go.Figure:
    """Give a figure that was made in another way the reports' look."""
    figure.update_layout(**_LOOK, height=height)
    figure.update_xaxes(automargin=True)
    figure.update_yaxes(automargin=True)
    return figure


def row(number: int) -> dict[str, str]:
    """Return the axes of a trace in a row of `rows`, counted from 1 at the top.

    Example:
        >>> row(1), row(2)
        ({'xaxis': 'x', 'yaxis': 'y'}, {'xaxis': 'x2', 'yaxis': 'y2'})
    """
    suffix = "" if number == 1 else str(number)
    return {"xaxis": f"x{suffix}", "yaxis": f"y{suffix}"}


def rows(
    shares: Sequence[float], apart: float, upright: Sequence[Keys]
) -> dict[str, dict[str, Any]]:
    """Return the axes of curves in rows below each other, over the same time.

    Args:
        shares: Heights of the rows from the top, (n,), in any unit.
        apart: Distance between rows, as a part of the figure's height.
        upright: Upright axis of each row, (n,).
    """
    count = len(shares)
    heights = (1.0 - apart * (count - 1)) / sum(shares) * np.array(shares)
    axes: dict[str, dict[str, Any]] = {}
    for k, figure in enumerate(upright):
        here = row(k + 1)
        x, y = here["xaxis"], here["yaxis"]
        low = float(heights[k + 1 :].sum()) + apart * (count - 1 - k)
        lowest = k == count - 1
        across = (
            {"title": "time [s]"} if lowest else {"matches": f"x{count}", "showticklabels": False}
        )
        axes[x.replace("x", "xaxis")] = {"anchor": y, "domain": [0.0, 1.0], **across}
        axes[y.replace("y", "yaxis")] = {"anchor": x, "domain": [low, low + heights[k]], **figure}
    return axes


def log_axis(**more: Any) -> dict[str, Any]:
    """Return what makes an axis logarithmic, with a tick a decade."""
    return {"type": "log", "dtick": 1, "tickformat": "~g", "exponentformat": "none", **more}


def curve(time: np.ndarray, values: np.ndarray, parts: int = PARTS) -> dict[str, np.ndarray]:
    """Return the points to draw of a curve (n,), any unit, over time [s], (n,)."""
    rows = extremes(time, values, parts)
    return {"x": time[rows], "y": values[rows]}


class DrawnLine(NamedTuple):
    """A curve over time.

    Attributes:
        name, color: Entry in the legend.
        time: Rising [s], (n,).
        values: In the unit of the figure's axis, (n,).
        width: Width [px].
        dash: "solid" or "dot".
    """

    name: str
    color: str
    time: np.ndarray | Sequence[float]
    values: np.ndarray
    width: float = 1.5
    dash: str = "solid"


def over_time(
    lines: Iterable[DrawnLine],
    label: str,
    height: int,
    time: str = "time [s]",
    yaxis: Keys | None = None,
    **layout: Any,
) -> go.Figure:
    """Draw curves over one time, with the labels of both axes.

    Args:
        lines: The curves.
        label, time: Titles of the axes.
        height: Height of the figure [px].
        yaxis: Other keys of the upright axis.
        layout: Other keys of the layout.
    """
    traces = [
        {
            **curve(np.asarray(line.time), line.values),
            "mode": "lines",
            "name": line.name,
            "line": {"color": line.color, "width": line.width, "dash": line.dash},
        }
        for line in lines
    ]
    upright = {"title": label, **(yaxis or {})}
    return drawn(traces, height, xaxis={"title": time}, yaxis=upright, **layout)


def rule(axis: str, at: float, **line: Any) -> Keys:
    """Return a straight line through the whole figure, a shape of its layout.

    Args:
        axis: "x" or "y", on which it is at one value.
        at: The value, in the axis's unit.
        line: Keys of the line.
    """
    other = "y" if axis == "x" else "x"
    there = {f"{axis}0": at, f"{axis}1": at, f"{axis}ref": axis}
    along = {f"{other}0": 0, f"{other}1": 1, f"{other}ref": f"{other} domain"}
    return {"type": "line", **there, **along, "line": line}
