"""Figures of an identification, drawn from the content of identified.json."""

from __future__ import annotations

import numpy as np
import plotly.graph_objects as go

from coupling.report.colours import AFTER, BEFORE, DESIRED
from coupling.report.intervals import interval_figure
from coupling.report.style import drawn
from coupling.results.identified_result import IdentifiedResult
from coupling.results.parameter_result import ParameterResult
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


def agreement(result: IdentifiedResult) -> go.Figure:
    """Every measured component over the predicted one."""
    names, _, measured, predicted = _rows(result)
    ends = _MM * np.array(
        [min(measured.min(), predicted.min()), max(measured.max(), predicted.max())]
    )
    equal = {
        "x": ends,
        "y": ends,
        "mode": "lines",
        "name": "equal",
        "line": {"color": DESIRED, "width": 1, "dash": "dot"},
    }
    components = [
        {
            "x": _MM * predicted[:, k],
            "y": _MM * measured[:, k],
            "mode": "markers",
            "name": axis,
            "marker": {"color": color, "size": 6, "opacity": 0.75},
            "text": names,
            "hovertemplate": "%{text}: %{y:.3f} mm measured, %{x:.3f} mm predicted",
        }
        for k, (axis, color) in enumerate(zip("xyz", (AFTER, "#009E73", BEFORE), strict=True))
    ]
    across, up = {"title": "predicted [mm]"}, {"title": "measured [mm]"}
    return drawn([equal, *components], 440, xaxis=across, yaxis=up)


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


def intervals(result: IdentifiedResult) -> go.Figure:
    """Fitted values with their intervals, beside the start values."""
    entries = result.parameters
    rows = []
    for entry in entries:
        value = entry.value or _far(entry)
        low, high = entry.low or 0.1 * value, entry.high or _far(entry)
        shown = {"name": label(entry), "value": value, "low": low, "high": high}
        rows.append(entry.model_copy(update=shown))
    starts = {
        "x": [entry.start for entry in entries if not entry.added],
        "y": [label(entry) for entry in entries if not entry.added],
        "mode": "markers",
        "name": "start file",
        "marker": {"symbol": "line-ns", "size": 14, "line": {"width": 2, "color": DESIRED}},
    }
    units = "N m/rad (backlash, slip angle: rad; hysteresis: N m)"
    axis = {"title": units, "exponentformat": "power"}
    words = "identified, 95 % interval", "not identified"
    return interval_figure(rows, words, 34, axis, [starts])


def _far(entry: ParameterResult) -> float:
    """Return where an unbounded interval ends on the page."""
    return 30.0 * max(entry.low or 0.0, entry.start or 0.0, 1e-9)


def label(entry: ParameterResult) -> str:
    """Return a parameter's name as short as it is clear."""
    return entry.name.removesuffix(".stiffness")


def _rows(result: IdentifiedResult) -> tuple[list[str], np.ndarray, np.ndarray, np.ndarray]:
    """Return names, places, measured and predicted displacements [m] of all rows."""
    place, measured, predicted = (
        result.displacements(key)[:, :3] for key in ("position_m", "measured", "predicted")
    )
    return [row.name for row in result.measurements], place, measured, predicted
