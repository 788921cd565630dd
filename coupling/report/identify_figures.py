"""Figures of an identification, drawn from the content of identified.json."""

from __future__ import annotations

import numpy as np
import plotly.graph_objects as go

from coupling.report.colours import AFTER, BEFORE
from coupling.report.style import drawn
from coupling.results.identified_result import IdentifiedResult
from coupling.results.scene import Scene, SceneLine

_MM = 1e3


def amplification(result: IdentifiedResult) -> int:
    """Return a round factor that makes the largest deflection about a quarter of the poses' extent."""
    _, place, measured, _ = _rows(result)
    largest = np.linalg.norm(measured, axis=1).max()
    size = max(float(np.ptp(place, axis=0).max()), 0.5)
    if not largest > 0.0:
        return 1
    factor = max(size / 4.0 / largest, 1.0)
    digit = 10.0 ** np.floor(np.log10(factor))
    return int(digit * max(d for d in (1, 2, 5) if d * digit <= factor))


def arrows(result: IdentifiedResult, factor: int) -> Scene:
    """Return measured and predicted deflections where the tool was, amplified."""
    _, place, measured, predicted = _rows(result)
    gaps = np.full_like(place, np.nan)
    return Scene(
        lines=[
            SceneLine(
                words,
                color,
                np.stack([place, place + factor * deflection, gaps], axis=1).reshape(-1, 3),
            )
            for words, deflection, color in (
                ("measured", measured, BEFORE),
                ("predicted", predicted, AFTER),
            )
        ]
    )


# Most measurements that are named on the axis of a narrow page.
_NAMED = 22


def residuals(result: IdentifiedResult) -> go.Figure:
    """Distance of measured from predicted by row, and predicted without that row."""
    names, _, measured, predicted = _rows(result)
    left_out_errors = result.displacements("left_out_error")[:, :3]
    traces = []
    labels = [f"{k + 1}: {name}" for k, name in enumerate(names)]  # names may come twice
    for words, errors, color in (
        ("fit of all rows", measured - predicted, AFTER),
        ("left out: fit of the others", left_out_errors, BEFORE),
    ):
        size = _MM * np.linalg.norm(errors, axis=1)
        detail = [", ".join(f"{_MM * value:+.3f}" for value in error) for error in errors]
        bars = {
            "type": "bar",
            "x": labels,
            "y": size,
            "name": words,
            "marker": {"color": color},
            "text": detail,
            "textposition": "none",
            "hovertemplate": "%{x}: %{y:.3f} mm (%{text})",
        }
        traces.append(bars)
    every = -(-len(names) // _NAMED)
    ticks = {"ticktext": names[::every], "tickvals": labels[::every], "tickangle": -90}
    across, up = {"title": "measurement", **ticks}, {"title": "distance [mm]"}
    return drawn(traces, 440, xaxis=across, yaxis=up, barmode="group")


def _rows(result: IdentifiedResult) -> tuple[list[str], np.ndarray, np.ndarray, np.ndarray]:
    """Return names, places, measured and predicted displacements [m] of all rows."""
    place, measured, predicted = (
        result.displacements(key)[:, :3] for key in ("position_m", "measured", "predicted")
    )
    return [row.name for row in result.measurements], place, measured, predicted
