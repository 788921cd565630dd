"""What the process leaves: its shape in a cut, and its fields in space."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np
import plotly.graph_objects as go
from scipy.interpolate import LinearNDInterpolator

from coupling.path.frame import Frame
from coupling.path.histories import ToolPath
from coupling.path.workpiece import Workpiece
from coupling.report.colours import AFTER, BEFORE, GREEN
from coupling.report.style import drawn
from coupling.results.scene import SceneSurface
from coupling.toolpaths.tilt import APPROACH

_MM = 1e3
# Points of a cut.
_SAMPLES = 400


def cut(workpieces: Mapping[str, Workpiece], envelope: np.ndarray | None = None) -> go.Figure:
    """Heights in the part's x-z plane, by what the pieces are called.

    Args:
        workpieces: The pieces.
        envelope: Lowest surface that the tool sweeps, x and z in the part [m], (n, 2); None: not drawn.
    """
    traces = []
    for name, piece in workpieces.items():
        x = np.linspace(*_range(piece.points[:, 0]), _SAMPLES)
        height = LinearNDInterpolator(piece.points[:, :2], piece.points[:, 2])(x, 0.0)
        line = {"color": BEFORE if name.startswith("before") else AFTER}
        trace = {"x": _MM * x, "y": _MM * height, "name": name, "showlegend": True, "line": line}
        traces.append(trace)
    if envelope is not None:
        line = {"color": GREEN, "dash": "dot"}
        x, z = _MM * envelope.T
        traces.append(
            {"x": x, "y": z, "name": "swept by the tool", "showlegend": True, "line": line}
        )
    return drawn(traces, 320, xaxis={"title": "x in the part [mm]"}, yaxis={"title": "z [mm]"})


def tool_envelope(desired: ToolPath, world_from_part: Frame, radius: float) -> np.ndarray:
    """Return the lowest surface that a ball at a tool's end sweeps in the part's x-z plane [m], (n, 2).

    Args:
        desired: Path of the tool's end, world frame.
        radius: Radius of the ball [m].
    """
    shaft = -desired.rotations[0].apply(APPROACH)
    centre = world_from_part.coordinates(desired.position[0] + radius * shaft)
    centre = centre[np.abs(centre[:, 1]) < radius]
    if len(centre) == 0:
        return np.empty((0, 2))
    reach = np.sqrt(radius**2 - centre[:, 1] ** 2)
    x = np.linspace((centre[:, 0] - reach).min(), (centre[:, 0] + reach).max(), _SAMPLES)
    depth = reach[:, None] ** 2 - (x - centre[:, :1]) ** 2
    swept = np.where(depth > 0.0, centre[:, 2:] - np.sqrt(np.maximum(depth, 0.0)), np.inf).min(
        axis=0
    )
    return np.column_stack([x, np.where(np.isfinite(swept), swept, np.nan)])


def workpiece_surface(name: str, piece: Workpiece) -> SceneSurface:
    """Return a workpiece in space, in the part's frame, with all its fields."""
    triangles = _triangles(piece.cells)
    halves = len(triangles) // len(piece.cells)
    fields = {}
    for label, values in piece.point_fields.items():
        words, factor = _as_drawn(label)
        fields[words] = factor * values
    for label, values in piece.cell_fields.items():
        words, factor = _as_drawn(label)
        fields[words] = np.tile(factor * values, halves)
    return SceneSurface(name, piece.points, triangles, fields)


def _as_drawn(label: str) -> tuple[str, float]:
    """Return what a field is called where it is drawn, and its values' factor: lengths in mm."""
    name, _, unit = label.partition(" [")
    return (f"{name} [mm]", _MM) if unit == "m]" else (label, 1.0)


def _triangles(cells: np.ndarray) -> np.ndarray:
    """Return cells as triangles; the two halves of all quadrangles one after the other."""
    if cells.shape[1] == 3:
        return cells
    return np.vstack([cells[:, [0, 1, 2]], cells[:, [0, 2, 3]]])


def _range(values: np.ndarray) -> tuple[float, float]:
    return float(values.min()), float(values.max())
