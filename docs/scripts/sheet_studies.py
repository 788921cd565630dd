"""Studies of the sheet alone, each a Markdown table of docs/sheet_fem.md."""

from __future__ import annotations

import sys
import tempfile
import time
from collections.abc import Iterable, Iterator
from dataclasses import dataclass
from itertools import pairwise
from operator import itemgetter
from pathlib import Path

import numpy as np

from coupling.sheet_fem.box import Box
from coupling.sheet_fem.contact import Sphere
from coupling.sheet_fem.forming import SheetModel, SheetSettings
from coupling.sheet_fem.material import Material
from coupling.sheet_fem.mesh import SheetMesh, limit_of_force
from docs.scripts.experiment import results
from docs.scripts.page import DOCS, table

sys.path.insert(0, str(DOCS.parent / "tests" / "helpers"))
from calculix_disc import Disc, disc_force
from calculix_plate import CCX, Plate, plunge_force

ALUMINIUM = Material(70e9, 0.33, 180e6, 0.00057, 0.229)
THICKNESS, RADIUS = 1e-3, 5e-3
WINDOW = 3.0 * RADIUS
WALL = np.deg2rad(45.0)
SHALLOW = np.array([0.1, 0.2, 0.5, 1.0])  # [mm]
THICK = np.array([1.0, 2.0, 3.0, 4.0, 5.0])  # [mm]


@dataclass
class Press:
    """A square sheet and a tool that has been put somewhere, with the work this took."""

    model: SheetModel
    tool: Sphere
    near: Box | None = None
    solutions: int = 0

    def __post_init__(self) -> None:
        self.state = self.model.flat()

    @classmethod
    def above(
        cls,
        side: float,
        elements: int,
        x: float = 0.0,
        settings: SheetSettings | None = None,
        thickness: float = THICKNESS,
    ) -> Press:
        """Return a tool that touches the flat sheet at (x, 0)."""
        model = SheetModel(
            SheetMesh((side, side), (elements, elements), thickness),
            ALUMINIUM,
            settings or SheetSettings(window=WINDOW),
        )
        return cls(model, model.sphere(np.array([x, 0.0, RADIUS + 0.5 * thickness]), RADIUS))

    def to(self, tcp: np.ndarray, everywhere: bool = True) -> np.ndarray:
        """Move the tool to a TCP in the part frame [m], (3,), and return the force on it [N]."""
        up = RADIUS + 0.5 * self.model.mesh.thickness
        tool = self.model.sphere(tcp + np.array([0.0, 0.0, up]), RADIUS)
        if everywhere:
            box = self.model.everywhere()
        else:
            box = self.near = self.model.near(self.near, tool.center[None])
        found = self.model.equilibrium(self.state, (self.tool,), (tool,), box)
        self.state, self.tool = found.state, tool
        self.solutions += 1
        return found.forces[0]


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


def shallow() -> str:
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


def thick() -> str:
    """Return forces of a deep plunge into a thick disc over the mesh, and CalculiX."""
    disc = Disc()
    strength, prestrain, exponent = 343.3, 0.0015, 0.184  # [MPa]; of benchmark 3's sheet
    rows: list[tuple[str, ...]] = []
    for element in (2.0, 1.0):
        forces = _thick_forces(
            disc, element, Material(72e9, 0.33, 1e6 * strength, prestrain, exponent)
        )
        rows.append((f"elements of {element:g} mm", *(f"{force:.0f}" for force in forces)))
    if CCX is not None:
        strains = np.concatenate([[0.0], np.geomspace(1e-4, 3.0, 80)])
        curve = zip(strains, strength * (prestrain + strains) ** exponent, strict=True)
        with tempfile.TemporaryDirectory() as folder:
            depths, forces = disc_force(disc, curve, 72e3, 0.33, Path(folder))
        solid = np.interp(THICK, depths, forces)
        rows.append(("**CalculiX**, CAX8R solids", *(f"{force:.0f}" for force in solid)))
    return table(("", *(f"{depth:g} mm" for depth in THICK)), rows)


def _thick_forces(disc: Disc, element: float, metal: Material) -> np.ndarray:
    """Return the forces [N] at THICK; what is farther from the middle than the clamp is held."""
    count = 4 * round((2.0 * disc.edge + 4.0 * element) / (4.0 * element))
    mesh = SheetMesh((1e-3 * element * count,) * 2, (count, count), 1e-3 * disc.thickness)
    held = np.linalg.norm(mesh.control_points()[..., :2], axis=-1)
    held = held >= 1e-3 * (disc.edge - 0.5 * element)  # as a clamped edge holds its control points
    model = SheetModel(mesh, metal, free=np.repeat(~held[..., None], 3, axis=2))
    touch = disc.radius + 0.5 * disc.thickness
    steps = np.arange(disc.increments + 1) * disc.plunge / disc.increments
    tools = [
        model.sphere(np.array([0.0, 0.0, 1e-3 * (touch - step)]), 1e-3 * disc.radius)
        for step in steps
    ]
    state, forces = model.flat(), [0.0]
    for before, after in pairwise(tools):
        found = model.equilibrium(state, (before,), (after,), model.everywhere())
        state = found.state
        forces.append(found.forces[0, 2])
    return np.interp(THICK, steps, forces)


def contours(
    press: Press, radius: float, depths: Iterable[float], spacing: float
) -> Iterator[float]:
    """Form contours of a cone and yield the mean axial force in each, but for its first and last sixth.

    Args:
        press: Above the start.
        radius: Of the TCP's path at the sheet's plane [m].
        depths: Of the contours [m].
        spacing: Of positions [m].
    """
    for depth in depths:
        r = radius - depth / np.tan(WALL)
        angles = np.linspace(0.0, 2.0 * np.pi, round(2.0 * np.pi * r / spacing) + 1)
        forces = []
        for angle in angles:
            tcp = np.array([r * np.cos(angle), r * np.sin(angle), -depth])
            forces.append(press.to(tcp, everywhere=False)[2])
        sixth = len(forces) // 6
        yield float(np.mean(forces[sixth:-sixth]))


# Of the study of fineness: thickness [mm], elements along 80 mm; positions and window [m].
FINENESS = ((0.5, 32), (0.5, 60), (1.0, 20), (1.0, 32), (1.0, 40), (1.0, 60), (2.0, 32), (2.0, 60))
_SPACING, _WINDOW = 2.5e-3, 10e-3


def fineness() -> str:
    """Return the forces in three contours on the plate over thickness and elements."""

    def cells(case: tuple[float, int]) -> list[str]:
        thickness, elements = case
        settings = SheetSettings(window=_WINDOW, opening_radius=0.024)
        press = Press.above(0.08, elements, 0.02, settings, 1e-3 * thickness)
        start = time.process_time()
        forces = np.array(list(contours(press, 0.02, (1e-3, 2e-3, 3e-3), _SPACING)))
        seconds = (time.process_time() - start) / press.solutions
        limit = limit_of_force(0.08 / elements, RADIUS, 1e-3 * thickness)
        computed, stated = (
            ", ".join(f"{force:.0f}" for force in row) for row in (forces, limit * forces)
        )
        return [computed, f"{1.0 / limit:.3f}", stated, f"{seconds:.2f}"]

    heads = ("F_z computed", "over its limit", "F_z stated", "CPU s / position")
    return results(
        ("sheet", "elements"),
        {(f"{sheet:g} mm", f"{80.0 / count:.3g} mm"): (sheet, count) for sheet, count in FINENESS},
        cells,
        {head: itemgetter(k) for k, head in enumerate(heads)},
    )
