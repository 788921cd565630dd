"""Figures of an identification, drawn from the content of identified.json."""

from __future__ import annotations

import numpy as np
import plotly.graph_objects as go

from coupling.report.colours import AFTER, BEFORE, DESIRED
from coupling.report.intervals import ShownInterval, interval_figure
from coupling.report.style import style
from coupling.results.identified_result import IdentifiedParameterResult, IdentifiedResult

_MM = 1e3


def amplification(found: IdentifiedResult) -> int:
    """Return a round factor that makes the largest deflection about a quarter of the poses' extent."""
    _, place, measured, _ = _rows(found)
    largest = np.linalg.norm(measured, axis=1).max()
    size = max(float(np.ptp(place, axis=0).max()), 0.5)
    if not largest > 0.0:
        return 1
    factor = max(size / 4.0 / largest, 1.0)
    digit = 10.0 ** np.floor(np.log10(factor))
    return int(digit * max(d for d in (1, 2, 5) if d * digit <= factor))


def arrows(found: IdentifiedResult, factor: int) -> go.Figure:
    """Draw measured and predicted deflections where the tool was, amplified."""
    names, place, measured, predicted = _rows(found)
    figure = go.Figure()
    for words, deflection, color, width, symbol in (
        ("measured", measured, BEFORE, 5, "circle"),
        ("predicted", predicted, AFTER, 5, "diamond"),
    ):
        tip = place + factor * deflection
        gaps = np.full_like(place, np.nan)
        x, y, z = np.stack([place, tip, gaps], axis=1).reshape(-1, 3).T
        line = {"color": color, "width": width}
        figure.add_scatter3d(
            x=x, y=y, z=z, mode="lines", legendgroup=words, line=line, showlegend=False
        )
        figure.add_scatter3d(
            **dict(zip("xyz", tip.T, strict=True)),
            mode="markers",
            name=words,
            legendgroup=words,
            marker={"color": color, "size": 3, "symbol": symbol},
            text=[
                f"{name}: {words} {_MM * size:.3f} mm"
                for name, size in zip(names, np.linalg.norm(deflection, axis=1), strict=True)
            ],
            hoverinfo="text",
        )
    axes = {f"{axis}axis": {"title": f"{axis} [m]"} for axis in "xyz"}
    camera = {"eye": {"x": 1.35, "y": -1.35, "z": 0.8}, "center": {"x": 0.0, "y": 0.0, "z": -0.15}}
    figure.update_layout(scene={**axes, "aspectmode": "data", "camera": camera})
    return style(figure, 620).update_layout(legend_itemsizing="constant")


def agreement(found: IdentifiedResult) -> go.Figure:
    """Every measured component over the predicted one."""
    names, _, measured, predicted = _rows(found)
    figure = go.Figure()
    ends = _MM * np.array(
        [min(measured.min(), predicted.min()), max(measured.max(), predicted.max())]
    )
    figure.add_scatter(
        x=ends,
        y=ends,
        mode="lines",
        name="equal",
        line={"color": DESIRED, "width": 1, "dash": "dot"},
    )
    for k, (axis, color) in enumerate(zip("xyz", (AFTER, "#009E73", BEFORE), strict=True)):
        figure.add_scatter(
            x=_MM * predicted[:, k],
            y=_MM * measured[:, k],
            mode="markers",
            name=axis,
            marker={"color": color, "size": 6, "opacity": 0.75},
            text=names,
            hovertemplate="%{text}: %{y:.3f} mm measured, %{x:.3f} mm predicted",
        )
    figure.update_xaxes(title="predicted [mm]")
    figure.update_yaxes(title="measured [mm]")
    return style(figure, 440)


# Most measurements that are named on the axis of a narrow page.
_NAMED = 22


def residuals(found: IdentifiedResult) -> go.Figure:
    """Distance of measured from predicted by row, and predicted without that row."""
    names, _, measured, predicted = _rows(found)
    left = np.array([row.left_out_error[:3] for row in found.measurements])
    figure = go.Figure()
    labels = [f"{k + 1}: {name}" for k, name in enumerate(names)]  # names may come twice
    for words, errors, color in (
        ("fit of all rows", measured - predicted, AFTER),
        ("left out: fit of the others", left, BEFORE),
    ):
        size = _MM * np.linalg.norm(errors, axis=1)
        detail = [", ".join(f"{_MM * value:+.3f}" for value in error) for error in errors]
        figure.add_bar(
            x=labels,
            y=size,
            name=words,
            marker={"color": color},
            text=detail,
            textposition="none",
            hovertemplate="%{x}: %{y:.3f} mm (%{text})",
        )
    every = -(-len(names) // _NAMED)
    ticks = {"ticktext": names[::every], "tickvals": labels[::every], "tickangle": -90}
    figure.update_xaxes(title="measurement", **ticks)
    figure.update_yaxes(title="distance [mm]")
    figure.update_layout(barmode="group")
    return style(figure, 440)


def intervals(found: IdentifiedResult) -> go.Figure:
    """Fitted values with their intervals, beside the start values."""
    entries = found.parameters
    rows = []
    for entry in entries:
        value = entry.value or _far(entry)
        low, high = entry.low or 0.1 * value, entry.high or _far(entry)
        rows.append(ShownInterval(label(entry), value, low, high, entry.identified))
    figure = interval_figure(rows, "identified, 95 % interval", "not identified", 34)
    figure.add_scatter(
        x=[entry.start for entry in entries if not entry.added],
        y=[label(entry) for entry in entries if not entry.added],
        mode="markers",
        name="start file",
        marker={"symbol": "line-ns", "size": 14, "line": {"width": 2, "color": DESIRED}},
    )
    units = "N m/rad (backlash, slip angle: rad; hysteresis: N m)"
    figure.update_xaxes(title=units, exponentformat="power")
    return figure


def _far(entry: IdentifiedParameterResult) -> float:
    """Return where an unbounded interval ends on the page."""
    return 30.0 * max(entry.low or 0.0, entry.start or 0.0, 1e-9)


def label(entry: IdentifiedParameterResult) -> str:
    """Return a parameter's name as short as it is clear."""
    return entry.name.removesuffix(".stiffness")


def _rows(found: IdentifiedResult) -> tuple[list[str], np.ndarray, np.ndarray, np.ndarray]:
    """Return names, places, measured and predicted displacements [m] of all rows."""
    rows = found.measurements
    place, measured, predicted = (
        np.array([getattr(row, key)[:3] for row in rows])
        for key in ("position_m", "measured", "predicted")
    )
    return [row.name for row in rows], place, measured, predicted
