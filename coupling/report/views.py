"""Views of the part, as a drawing shows it."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
import plotly.graph_objects as go

from coupling.path.frame import Frame
from coupling.path.histories import ToolPath
from coupling.report.part_deviation import signed_deviation
from coupling.report.static_scene import colour
from coupling.report.style import Keys, drawn, length_unit
from coupling.report.thinning import extremes

# Points of a path in a view, and parts of its time of which the extremes are among them.
_POINTS, _PARTS = 4000, 500
# Steps of the colours to each side.
_COLOURS = 10
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
    def normal(self) -> np.ndarray:
        """Deviation normal to the part, positive away from it [m], (n,)."""
        return signed_deviation(self.desired, self.actual)[:, 0]


def from_above(views: Sequence[PathView]) -> tuple[go.Figure, ...]:
    """Draw paths along their part's z axis, coloured by normal deviation, all on one scale."""
    normals = [view.normal for view in views]
    largest = max(float(np.abs(values).max()) for values in normals)
    factor, unit = length_unit(largest)
    end = max(factor * largest, 1e-3)
    return tuple(
        _draw_coloured(view, factor * values, end, unit)
        for view, values in zip(views, normals, strict=True)
    )


def _draw_coloured(view: PathView, values: np.ndarray, end: float, unit: str) -> go.Figure:
    """Draw one path from above, coloured by its normal deviation on a scale from -end to end."""
    traces: list[Keys] = []
    rows = rows_in_space(view.desired.time, values)
    x, y, _ = view.in_part.T
    # A piece between two rows is as bad as its worse end; the worst are drawn last, and so on top.
    first, last = values[rows[:-1]], values[rows[1:]]
    worse = np.where(np.abs(first) > np.abs(last), first, last)
    number = np.clip(np.round(_COLOURS * worse / end), -_COLOURS, _COLOURS).astype(int)
    for k in sorted(np.unique(number), key=abs):
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
            "name": f"about {k / _COLOURS * end:.2g} {unit}",
            "line": {"color": colour(k / _COLOURS), "width": 2.5},
            "hovertemplate": "x %{x:.1f} mm, y %{y:.1f} mm",
        }
        traces.append(piece)
    labels = ("x in the part [mm]", "y in the part [mm]")
    return _as_drawn(traces, view.title, labels, (x, y), (end, unit))


def _bar(end: float, unit: str, height: float) -> Keys:
    """Return the bar of colours below a view of a height [px]."""
    return {
        "x": [None],
        "y": [None],
        "mode": "markers",
        "showlegend": False,
        "marker": {
            "color": [0.0],
            "cmin": -end,
            "cmax": end,
            "colorscale": [[k / 10, colour(k / 5 - 1.0)] for k in range(11)],
            "showscale": True,
            "colorbar": {
                "title": {"text": f"normal deviation [{unit}]", "side": "bottom"},
                "orientation": "h",
                "thickness": 12,
                "len": 1.0,
                "y": -56.0 / height,
                "yanchor": "top",
            },
        },
    }


def _with_end(values: np.ndarray, pieces: np.ndarray, gap: float) -> np.ndarray:
    """Return the ends of neighbouring pieces of a line, and a gap behind them."""
    return np.concatenate([values[pieces[0] : pieces[-1] + 2], [gap]])


def _as_drawn(
    traces: list[Keys],
    title: str,
    labels: tuple[str, str],
    points: tuple[np.ndarray, np.ndarray],
    colours: tuple[float, str],
) -> go.Figure:
    """Return a view with one scale on both axes, a title, a height that suits, and a bar of `colours`.

    The bar goes from minus to plus their end, in their unit.
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
    return drawn(
        [*traces, _bar(*colours, height)],
        int(height) + 74 + _BAR,
        margin={"b": 46 + _BAR},
        xaxis=x,
        yaxis={**y, "scaleanchor": "x"},
        title={"text": title, "font": {"size": 14}, "x": 0.5, "y": 0.985},
    )
