"""The look that all figures of the reports share; the page's script adds light and dark."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from typing import Any, NamedTuple

import numpy as np
import plotly.graph_objects as go

from coupling.report.thinning import PARTS, extremes

UM = 1e6
# Smallest distance shown on a logarithmic axis [um]; a nanometre is below every figure of interest.
FLOOR_UM = 1e-3


def style(figure: go.Figure, height: int = 380) -> go.Figure:
    """Give a figure the reports' look; its legend is the page's."""
    figure.update_layout(
        template="none",
        height=height,
        margin={"l": 64, "r": 16, "t": 28, "b": 46},
        showlegend=False,
        font={"family": "system-ui, sans-serif", "size": 12},
    )
    figure.update_xaxes(automargin=True)
    figure.update_yaxes(automargin=True)
    return figure


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
    lines: Iterable[DrawnLine], label: str, height: int, time: str = "time [s]"
) -> go.Figure:
    """Draw curves over one time, with the labels of both axes; `height` is in [px]."""
    figure = go.Figure()
    for own in lines:
        points = curve(np.asarray(own.time), own.values)
        line = {"color": own.color, "width": own.width, "dash": own.dash}
        figure.add_scatter(**points, mode="lines", name=own.name, line=line)
    figure.update_xaxes(title=time)
    figure.update_yaxes(title=label)
    return style(figure, height)


def shown_distance(distance: np.ndarray) -> np.ndarray:
    """Return a distance [m], (n,), in [um], no less than a logarithmic axis shows."""
    return np.maximum(UM * distance, FLOOR_UM)


def decades(low: float, high: float) -> dict[str, Any]:
    """Return ticks of a linear axis that shows decimal logarithms.

    Args:
        low, high: Ends of the axis, decimal logarithms.

    Example:
        >>> decades(-0.7, 2.1)
        {'tickvals': [0, 1, 2], 'ticktext': ['1', '10', '100']}
    """
    exponents = list(range(int(np.ceil(low - 1e-9)), int(np.floor(high + 1e-9)) + 1))
    return {"tickvals": exponents, "ticktext": [f"{10.0**k:g}" for k in exponents]}
