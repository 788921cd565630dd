"""Values with their intervals, a row for each."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np
import plotly.graph_objects as go

from coupling.report.colours import AFTER, QUIET
from coupling.report.style import Keys, drawn
from coupling.results.parameter_result import ParameterResult


def interval_figure(
    rows: Sequence[ParameterResult],
    words: tuple[str, str],
    height: int,
    xaxis: Keys,
    more: Sequence[Keys] = (),
    **layout: Any,
) -> go.Figure:
    """Draw intervals over a logarithmic axis, the first row at the top.

    Args:
        rows: Parameters whose value and ends of the interval are numbers.
        words: Legends of those that are identifiable and of the others.
        height: Height of a row [px].
        xaxis: Other keys of the axis of the values.
        more: Other traces, drawn at the names.
        layout: Other keys of the layout.
    """
    traces, upwards = [], rows[::-1]
    for name, certain, color in zip(words, (True, False), (AFTER, QUIET), strict=True):
        rows_of_kind = [row for row in upwards if row.identified is certain]
        numbers = [(row.value, row.low, row.high) for row in rows_of_kind]
        value, low, high = np.array(numbers, dtype=float).reshape(-1, 3).T
        ends = {
            "type": "data",
            "symmetric": False,
            "array": (high - value).tolist(),
            "arrayminus": (value - low).tolist(),
            "color": color,
        }
        trace = {
            "x": value.tolist(),
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
