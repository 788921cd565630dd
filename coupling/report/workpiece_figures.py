"""Figures of what the process leaves: its shape in a cut, and its fields in space."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np
import plotly.graph_objects as go
from scipy.interpolate import LinearNDInterpolator

from coupling.path.workpiece import Workpiece
from coupling.report.colours import AFTER, BEFORE
from coupling.report.style import Keys, drawn, in_space

_MM = 1e3
# Points of a cut.
_SAMPLES = 400


def cut(workpieces: Mapping[str, Workpiece]) -> go.Figure:
    """Heights in the part's x-z plane, by what the pieces are called."""
    traces = []
    for (name, piece), color in zip(workpieces.items(), (BEFORE, AFTER), strict=False):
        x = np.linspace(*_range(piece.points[:, 0]), _SAMPLES)
        height = LinearNDInterpolator(piece.points[:, :2], piece.points[:, 2])(x, 0.0)
        line = {"color": color}
        trace = {"x": _MM * x, "y": _MM * height, "name": name, "showlegend": True, "line": line}
        traces.append(trace)
    return drawn(traces, 320, xaxis={"title": "x in the part [mm]"}, yaxis={"title": "z [mm]"})


def fields(workpieces: Mapping[str, Workpiece]) -> tuple[go.Figure, ...]:
    """Every field of the workpieces, chosen from a menu: a figure for each, on the same scales."""
    first = next(iter(workpieces.values()))
    labels = [*first.point_fields, *first.cell_fields]
    limits = {
        label: _range(np.concatenate([_values(piece, label) for piece in workpieces.values()]))
        for label in labels
    }
    return tuple(_shaped(name, piece, limits) for name, piece in workpieces.items())


def _shaped(name: str, piece: Workpiece, limits: Mapping[str, tuple[float, float]]) -> go.Figure:
    """Draw one workpiece, coloured by one of its fields."""
    traces = [
        _surface(piece, label, ends, visible=number == 0)
        for number, (label, ends) in enumerate(limits.items())
    ]
    buttons = [
        {
            "label": _as_drawn(label)[0],
            "method": "restyle",
            "args": [{"visible": [other == label for other in limits]}],
        }
        for label in limits
    ]
    scene = in_space(
        "mm",
        aspectmode="manual",
        aspectratio={"x": 1.0, "y": 1.0, "z": 0.35},
        camera={"eye": {"x": 1.2, "y": -1.2, "z": 1.1}},
    )
    return drawn(
        traces,
        460,
        margin={"l": 10, "r": 10, "b": 70},
        title={"text": name, "font": {"size": 14}, "x": 0.5, "y": 0.985},
        updatemenus=[{"buttons": buttons, "x": 0.0, "xanchor": "left", "y": 1.0}],
        scene=scene,
    )


def _values(piece: Workpiece, label: str) -> np.ndarray:
    """Return a field of points or cells."""
    fields = piece.cell_fields if label in piece.cell_fields else piece.point_fields
    return fields[label]


def _as_drawn(label: str) -> tuple[str, float]:
    """Return what a field is called where it is drawn, and its values' factor: lengths in mm."""
    name, _, unit = label.partition(" [")
    return (f"{name} [mm]", _MM) if unit == "m]" else (label, 1.0)


def _surface(piece: Workpiece, label: str, limits: tuple[float, float], visible: bool) -> Keys:
    """Return the surface in triangles, coloured by a field of its points or cells."""
    x, y, z = np.round(_MM * piece.points.T, 3)
    triangles = _triangles(piece.cells)
    of_cells = label in piece.cell_fields
    values = _values(piece, label)
    if of_cells:
        values = np.tile(values, len(triangles) // len(values))
    title, scale = _as_drawn(label)
    return {
        "type": "mesh3d",
        "x": x,
        "y": y,
        "z": z,
        "i": triangles[:, 0],
        "j": triangles[:, 1],
        "k": triangles[:, 2],
        "intensity": _as_seen(scale * values, scale * (limits[1] - limits[0])),
        "cmin": scale * limits[0],
        "cmax": scale * limits[1],
        "intensitymode": "cell" if of_cells else "vertex",
        "colorscale": "Viridis",
        "colorbar": {
            "title": {"text": title, "side": "bottom"},
            "orientation": "h",
            "thickness": 12,
            "y": -0.02,
            "yanchor": "top",
        },
        "visible": visible,
        "flatshading": False,
    }


def _as_seen(values: np.ndarray, span: float) -> np.ndarray:
    """Return values in as many digits as colours tell, a thousandth of their span."""
    return np.round(values, 3 - int(np.floor(np.log10(span)))) if span > 0.0 else values


def _triangles(cells: np.ndarray) -> np.ndarray:
    """Return cells as triangles; the two halves of all quadrangles one after the other."""
    if cells.shape[1] == 3:
        return cells
    return np.vstack([cells[:, [0, 1, 2]], cells[:, [0, 2, 3]]])


def _range(values: np.ndarray) -> tuple[float, float]:
    return float(values.min()), float(values.max())
