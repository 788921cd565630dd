"""Surface of a workpiece with fields on it, kept as VTK."""

from __future__ import annotations

from dataclasses import dataclass, field
from pathlib import Path

import numpy as np

from coupling.errors import ResultError, reason_of


@dataclass(frozen=True)
class Workpiece:
    """A surface of triangles or quadrangles with fields on it.

    A process answers with it beside the wrench; the run folder then gets it as VTK (for ParaView) and
    the report draws it.  A process that runs a program of its own reads it from the program's file
    with `read`.

    Attributes:
        points: Points in the part frame [m], (n, 3).
        cells: Numbers of the corners, (m, 3) or (m, 4).
        point_fields: Name with unit -> values at the points, (n,).
        cell_fields: Name with unit -> values in the cells, (m,).

    Raises:
        ValueError: If sizes do not agree.

    Example:
        >>> corners = np.array([[0, 0, 0], [1, 0, 0], [1, 1, 0], [0, 1, 0.0]])
        >>> plate = Workpiece(corners, np.array([[0, 1, 2, 3]]), {"height [m]": np.zeros(4)})
        >>> list(plate.point_fields)
        ['height [m]']
    """

    points: np.ndarray
    cells: np.ndarray
    point_fields: dict[str, np.ndarray] = field(default_factory=dict)
    cell_fields: dict[str, np.ndarray] = field(default_factory=dict)

    def __post_init__(self) -> None:
        if self.points.ndim != 2 or self.points.shape[1] != 3:
            raise ValueError(f"workpiece: points: expected shape (n, 3), got {self.points.shape}")
        if self.cells.ndim != 2 or self.cells.shape[1] not in (3, 4):
            raise ValueError(
                f"workpiece: cells: expected shape (m, 3) or (m, 4), got {self.cells.shape}"
            )
        for fields, count in ((self.point_fields, self.points), (self.cell_fields, self.cells)):
            for name, values in fields.items():
                if values.shape != (len(count),):
                    raise ValueError(
                        f"workpiece: {name}: expected shape ({len(count)},), got {values.shape}"
                    )

    def write(self, file: Path) -> None:
        """Write a VTK file; its ending chooses the kind, .vtu unless you know better.

        Raises:
            ResultError: If meshio is not installed or the file cannot be written.
        """
        meshio = _meshio(file)
        cells = [(_KINDS[self.cells.shape[1]], self.cells)]
        mesh = meshio.Mesh(
            self.points,
            cells,
            point_data=self.point_fields,
            cell_data={name: [values] for name, values in self.cell_fields.items()},
        )
        try:
            mesh.write(file)
        except OSError as cause:
            raise ResultError(f"{file}: cannot be written: {reason_of(cause)}") from cause

    @classmethod
    def read(cls, file: Path) -> Workpiece:
        """Read the triangles or quadrangles of any file that meshio knows.

        Raises:
            ResultError: If meshio is not installed, or the file cannot be read or has none.
        """
        meshio = _meshio(file)
        try:
            mesh = meshio.read(file)
        except (OSError, meshio.ReadError) as cause:
            raise ResultError(f"{file}: cannot be read: {cause}") from cause
        for index, block in enumerate(mesh.cells):
            if block.type in _KINDS.values():
                return cls(
                    np.asarray(mesh.points, dtype=float),
                    np.asarray(block.data),
                    {name: v for name, v in mesh.point_data.items() if v.ndim == 1},
                    {name: v[index] for name, v in mesh.cell_data.items() if v[index].ndim == 1},
                )
        raise ResultError(f"{file}: expected triangles or quadrangles, got none")


_KINDS = {3: "triangle", 4: "quad"}


def _meshio(file: Path):  # type: ignore[no-untyped-def]  # the module, imported where needed
    try:
        import meshio
    except ImportError as cause:
        raise ResultError(
            f"{file}: VTK files need the package meshio, which is not installed: install the extra,"
            " pip install 'elastic-robot-fmu[fem]'"
        ) from cause
    return meshio
