"""Studies of the sheet alone, each a Markdown table of docs/sheet_fem.md."""

from __future__ import annotations

import sys
import tempfile
import time
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from coupling.sheet_fem.contact import Sphere
from coupling.sheet_fem.forming import SheetModel, SheetSettings
from coupling.sheet_fem.material import Material
from coupling.sheet_fem.mesh import SheetMesh
from docs.scripts.page import DOCS, table

sys.path.insert(0, str(DOCS.parent / "tests" / "helpers"))
from calculix_plate import CCX, Plate, plunge_force

ALUMINIUM = Material(70e9, 0.33, 180e6, 0.00057, 0.229)
THICKNESS, RADIUS = 1e-3, 5e-3
SHALLOW = np.array([0.1, 0.2, 0.5, 1.0])  # [mm]
DEEP = np.array([1.0, 2.0, 3.0, 5.0])  # [mm]


@dataclass
class Press:
    """A square sheet and a tool that has been put somewhere, with the work this took."""

    model: SheetModel
    tool: Sphere
    iterations: int = 0
    solutions: int = 0

    def __post_init__(self) -> None:
        self.state = self.model.flat()

    @classmethod
    def above(
        cls, side: float, elements: int, x: float = 0.0, settings: SheetSettings | None = None
    ) -> Press:
        """Return a tool that touches the flat sheet at (x, 0)."""
        model = SheetModel(
            SheetMesh((side, side), (elements, elements), THICKNESS),
            ALUMINIUM,
            settings or SheetSettings(window=0.02),
        )
        return cls(model, model.sphere(_center(np.array([x, 0.0, 0.0])), RADIUS))

    def to(self, tcp: np.ndarray, everywhere: bool = True) -> np.ndarray:
        """Move the tool to a TCP in the part frame [m], (3,), and return the force on it [N]."""
        tool = self.model.sphere(_center(tcp), RADIUS)
        box = self.model.everywhere() if everywhere else self.model.window(tool.center)
        found = self.model.equilibrium(self.state, (self.tool,), (tool,), box)
        self.state, self.tool = found.state, tool
        self.iterations += found.iterations
        self.solutions += 1
        return found.forces[0]

    def steepest(self) -> float:
        """Return the steepest slope of the midsurface along the part's x axis [rad]."""
        points = self.state.points
        corners = 0.25 * (points[:-1, :-1] + points[1:, :-1] + points[:-1, 1:] + points[1:, 1:])
        cut = np.diff(corners[:, corners.shape[1] // 2], axis=0)
        return float(np.max(np.arctan2(cut[:, 2], cut[:, 0])))


def _center(tcp: np.ndarray) -> np.ndarray:
    """Return the sphere's centre in the sheet's frame."""
    return tcp + np.array([0.0, 0.0, RADIUS + 0.5 * THICKNESS])


def plunge_curve(side: float, elements: int, depths: np.ndarray) -> np.ndarray:
    """Return the forces [N] at depths [mm], reached in steps of 0.1 mm."""
    press = Press.above(side, elements)
    steps = np.arange(1, round(10 * depths[-1]) + 1) / 10.0
    forces = [press.to(np.array([0.0, 0.0, -1e-3 * step]))[2] for step in steps]
    return np.interp(depths, steps, forces)


def calculix_curve() -> np.ndarray | None:
    """Return the forces [N] at the shallow depths, or None without CalculiX."""
    if CCX is None:
        return None
    strains = np.concatenate([[0.0], np.logspace(-4, 0, 40)])
    stresses = 180.0 * (0.00057 + strains) ** 0.229
    curve = list(zip(strains.tolist(), stresses.tolist(), strict=True))
    plate = Plate(elements=14, layers=3, finest=0.6)
    with tempfile.TemporaryDirectory() as folder:
        depths, forces = plunge_force(plate, curve, 70e3, 0.33, Path(folder))
    return np.interp(SHALLOW, depths, forces)


def shallow_table() -> str:
    """Return forces of a shallow plunge over the mesh, and CalculiX."""
    curves = {
        f"elements of {50.0 / elements:.3g} mm": plunge_curve(0.05, elements, SHALLOW)
        for elements in (10, 20, 30, 40)
    }
    solid = calculix_curve()
    if solid is not None:
        curves["**CalculiX**, C3D8I solids"] = solid
    return table(
        ("", *(f"{depth} mm" for depth in SHALLOW)),
        ((name, *(f"{force:.1f}" for force in forces)) for name, forces in curves.items()),
    )


def deep_table() -> str:
    """Return forces of a deep plunge over the mesh, and the time."""
    rows = []
    for elements in (20, 30, 40):
        start = time.process_time()
        forces = plunge_curve(0.1, elements, DEEP)
        seconds = time.process_time() - start
        figures = (f"{value:.0f}" for value in (*forces, seconds))
        rows.append((f"elements of {100.0 / elements:.3g} mm", *figures))
    return table(("", *(f"{depth:g} mm" for depth in DEEP), "s"), rows)
