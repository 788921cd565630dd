"""Values with their intervals, a row for each."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import plotly.graph_objects as go

from coupling.report.colours import AFTER, QUIET
from coupling.report.style import Keys, drawn


@dataclass(frozen=True)
class ShownInterval:
    """A value with its interval.

    Attributes:
        name: Its name.
        value: The value.
        low, high: Ends of the interval.
        sure: Whether the measurements identify it.
    """

    name: str
    value: float
    low: float
    high: float
    sure: bool


def interval_figure(
    rows: Sequence[ShownInterval],
    words: tuple[str, str],
    height: int,
    xaxis: Keys,
    more: Sequence[Keys] = (),
    **layout: Any,
) -> go.Figure:
    """Draw intervals over a logarithmic axis, the first row at the top.

    Args:
        rows: Values with their intervals.
        words: Legends of those that are identifiable and of the others.
        height: Height of a row [px].
        xaxis: Other keys of the axis of the values.
        more: Other traces, drawn at the names.
        layout: Other keys of the layout.
    """
    traces, upwards = [], rows[::-1]
    for name, certain, color in zip(words, (True, False), (AFTER, QUIET), strict=True):
        rows_of_kind = [row for row in upwards if row.sure is certain]
        ends = {
            "type": "data",
            "symmetric": False,
            "array": [row.high - row.value for row in rows_of_kind],
            "arrayminus": [row.value - row.low for row in rows_of_kind],
            "color": color,
        }
        trace = {
            "x": [row.value for row in rows_of_kind],
            "y": [row.name for row in rows_of_kind],
            "mode": "markers",
            "name": name,
            "marker": {"color": color, "size": 9},
            "error_x": ends,
        }
        traces.append(trace)
    return drawn(
        [*traces, *more],
        170 + height * len(rows),
        xaxis={"type": "log", **xaxis},
        yaxis={"categoryorder": "array", "categoryarray": [row.name for row in upwards]},
        **layout,
    )
