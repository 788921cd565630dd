"""Prediction of a sheet whose tools go on as they came: its last move, carried along with them."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from scipy.ndimage import map_coordinates
from scipy.spatial.transform import Rotation

from coupling.sheet_fem.box import Box
from coupling.sheet_fem.contact import Sphere
from coupling.sheet_fem.mesh import SheetMesh

# A way that much longer or shorter than the last one is another one ...
_MAX_LENGTH_RATIO = 2.0
# ... and so is one that turns by more [rad] ...
_MAX_DIRECTION_CHANGE = 0.5
# ... or one that takes any tool elsewhere by more, over the way of the one that goes farthest.
_MAX_DIVERGENCE = 0.2
# A tool that goes less along the sheet, over its way, has no direction there.
_MIN_TANGENTIAL_PART = 0.1


class Increment(NamedTuple):
    """Moves of a sheet and the tools on it from one equilibrium to the next.

    Attributes:
        begin: Centres of the tools before [m], (tools, 3).
        end: Centres after [m], (tools, 3).
        displacements: Moves of the sheet's control points [m], (nx + 2, ny + 2, 3).
    """

    begin: np.ndarray
    end: np.ndarray
    displacements: np.ndarray

    @classmethod
    def of(cls, tools: tuple[Sphere, ...], displacements: np.ndarray) -> Increment:
        """Return the increment of a sheet whose control points moved [m], (nx + 2, ny + 2, 3)."""
        end = _centers(tools)
        return cls(
            end - np.array([tool.displacement for tool in tools]).reshape(-1, 3), end, displacements
        )

    def predict_moves(
        self, mesh: SheetMesh, tools: tuple[Sphere, ...], box: Box
    ) -> np.ndarray | None:
        """Return the next moves of the control points; None if the tools do not go on as they came.

        What the tools did to the sheet they do again, farther on and turned with their path.

        Args:
            mesh: Grid of the sheet.
            tools: Tools where they go.
            box: Control points that are asked for.

        Returns:
            Moves [m], (nx + 2, ny + 2, 3), zero outside of the box.
        """
        centers = _centers(tools)
        onward = self._onward(centers)
        if onward is None:
            return None
        lead, stretch, turn = onward
        at = np.stack(np.meshgrid(*box.ranges, indexing="ij"), axis=-1)
        place = mesh.place(at) - centers[lead, :2]
        # Where, seen from the tool, what comes here was before.
        before = mesh.control_point(self.end[lead, :2] + place @ turn[:2, :2])
        # Linear between control points: that evens out what belongs to the grid and not to the tool.
        displacements = [
            map_coordinates(
                self.displacements[..., k], np.moveaxis(before, -1, 0), order=1, mode="nearest"
            )
            for k in range(3)
        ]
        moves = np.zeros_like(self.displacements)
        moves[at[..., 0], at[..., 1]] = stretch * np.stack(displacements, axis=-1) @ turn.T
        return moves

    def _onward(self, centers: np.ndarray) -> tuple[int, float, np.ndarray] | None:
        """Return the tool that goes farthest, and what stretches and turns the last ways into the next.

        The turn is about z, (3, 3); None if the tools do not go on as they came.
        """
        if centers.shape != self.end.shape or not len(centers):
            return None
        came, goes = self.end - self.begin, centers - self.end
        lengths = np.linalg.norm(goes, axis=1)
        lead = int(np.argmax(lengths))
        length, before = float(lengths[lead]), float(np.linalg.norm(came[lead]))
        if not before / _MAX_LENGTH_RATIO < length < before * _MAX_LENGTH_RATIO:
            return None
        angle = _angle(came[lead], goes[lead])
        stretch, turn = length / before, Rotation.from_rotvec([0.0, 0.0, angle]).as_matrix()
        astray = np.max(np.linalg.norm(goes - stretch * came @ turn.T, axis=1))
        goes_on = abs(angle) <= _MAX_DIRECTION_CHANGE and astray <= _MAX_DIVERGENCE * length
        return (lead, stretch, turn) if goes_on else None


def _centers(tools: tuple[Sphere, ...]) -> np.ndarray:
    """Return the tools' centres [m], (tools, 3)."""
    return np.array([tool.center for tool in tools]).reshape(-1, 3)


def _angle(came: np.ndarray, goes: np.ndarray) -> float:
    """Return the angle between two ways in the sheet's plane [rad]; 0 if one has no direction there."""
    for way in (came, goes):
        if np.linalg.norm(way[:2]) < _MIN_TANGENTIAL_PART * np.linalg.norm(way):
            return 0.0
    across = came[0] * goes[1] - came[1] * goes[0]
    return float(np.arctan2(across, came[:2] @ goes[:2]))
