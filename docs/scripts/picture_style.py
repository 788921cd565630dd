"""One look for the pictures of the pages on processes and cells."""

from __future__ import annotations

import plotly.graph_objects as go


def styled(figure: go.Figure, width: int, height: int) -> go.Figure:
    """Return the figure with the pages' look and a size in pixels."""
    figure.update_layout(
        template="plotly_white",
        width=width,
        height=height,
        margin={"l": 70, "r": 20, "t": 50, "b": 50},
        legend={"orientation": "h", "y": 1.14, "x": 0.5, "xanchor": "center"},
        font={"family": "system-ui, sans-serif", "size": 14},
    )
    return figure
