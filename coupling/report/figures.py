"""Figures of a cell of several robots."""

from __future__ import annotations

import plotly.graph_objects as go

from coupling.report.colours import AFTER, BEFORE, DESIRED
from coupling.report.style import curve, style
from coupling.run.stored_run import StoredRun


def gap(cell: StoredRun) -> go.Figure:
    """Gap between the tools of a cell over time, actual and as commanded."""
    figure = go.Figure()
    assert cell.gap is not None
    assert cell.figures.pinch_gap_m is not None
    time = cell.first.desired.time
    for values, name, color in zip(cell.gap.T, cell.figures.stages, (BEFORE, AFTER), strict=False):
        points = curve(time, 1e3 * values)
        figure.add_scatter(
            **points, name=name, mode="lines", showlegend=True, line={"color": color}
        )
    commanded = 1e3 * cell.figures.pinch_gap_m.commanded
    figure.add_hline(y=commanded, line={"color": DESIRED, "dash": "dash", "width": 1})
    figure.update_yaxes(title="gap [mm]")
    figure.update_xaxes(title="time [s]")
    return style(figure, 320)
