"""Values with their intervals, a row for each."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import plotly.graph_objects as go

from coupling.report.colours import AFTER, QUIET
from coupling.report.style import style


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
    rows: Sequence[ShownInterval], sure: str, unsure: str, height: int
) -> go.Figure:
    """Draw intervals over a logarithmic axis, the first row at the top.

    Args:
        rows: Values with their intervals.
        sure, unsure: Legends of those that are identifiable and of the others.
        height: Height of a row [px].
    """
    figure, upwards = go.Figure(), rows[::-1]
    for words, certain, color in ((sure, True, AFTER), (unsure, False, QUIET)):
        own = [row for row in upwards if row.sure is certain]
        figure.add_scatter(
            x=[row.value for row in own],
            y=[row.name for row in own],
            mode="markers",
            name=words,
            marker={"color": color, "size": 9},
            error_x={
                "type": "data",
                "symmetric": False,
                "array": [row.high - row.value for row in own],
                "arrayminus": [row.value - row.low for row in own],
                "color": color,
            },
        )
    figure.update_xaxes(type="log")
    names = [row.name for row in upwards]
    figure.update_yaxes(categoryorder="array", categoryarray=names, automargin=True)
    return style(figure, 170 + height * len(rows))
