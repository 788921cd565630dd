"""The formed sheet as a surface to look at."""

from __future__ import annotations

import numpy as np

from coupling.path.workpiece import Workpiece
from coupling.sheet_fem.mesh import SheetMesh
from coupling.sheet_fem.state import SheetState

DEFLECTION = "deflection [m]"
SPRINGBACK = "springback [m]"
THICKNESS = "thickness [m]"
PLASTIC_STRAIN = "equivalent plastic strain"


def formed_sheet(mesh: SheetMesh, loaded: SheetState, unloaded: SheetState) -> Workpiece:
    """Return the midsurface of the unloaded sheet at the elements' corners, part frame.

    Deflection is the height over the flat midsurface; springback how much higher a point is without
    the tool than with it at its last contact.  Cells carry thickness and the largest plastic strain
    over it.

    Args:
        mesh: Grid of the sheet.
        loaded: State with the tool at its last contact.
        unloaded: State after it.
    """
    corners, before = _corners(unloaded.points), _corners(loaded.points)
    nx, ny = mesh.elements
    index = np.arange((nx + 1) * (ny + 1)).reshape(nx + 1, ny + 1)
    cells = np.stack([index[:-1, :-1], index[1:, :-1], index[1:, 1:], index[:-1, 1:]], axis=-1)
    below = np.array([0.0, 0.0, -0.5 * mesh.thickness])  # the part's plane is the upper face
    return Workpiece(
        points=corners.reshape(-1, 3) + below,
        cells=cells.reshape(-1, 4),
        point_fields={
            DEFLECTION: corners[..., 2].ravel(),
            SPRINGBACK: (corners - before)[..., 2].ravel(),
        },
        cell_fields={
            THICKNESS: mesh.thickness * unloaded.stretch.mean(axis=2).ravel(),
            PLASTIC_STRAIN: unloaded.plastic[..., 3].max(axis=(2, 3)).ravel(),
        },
    )


def _corners(points: np.ndarray) -> np.ndarray:
    """Return the surface at the elements' corners: the mean of four control points each."""
    corners: np.ndarray = 0.25 * (
        points[:-1, :-1] + points[1:, :-1] + points[:-1, 1:] + points[1:, 1:]
    )
    return corners
