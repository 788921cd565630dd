"""Write the tables of docs/sheet_fem.md anew: make sheet-fem.  CalculiX runs where it is installed."""

from __future__ import annotations

import sys
import tempfile
import time
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from coupling.process.isf_force_law import scallop_height, steady_force
from coupling.process.sheet.contact import Sphere
from coupling.process.sheet.forming import SheetModel, SheetSettings
from coupling.process.sheet.material import Material, tensile_strength
from coupling.process.sheet.mesh import SheetMesh
from coupling.report import workpiece_figures
from coupling.results import read_run
from docs.screenshot import save_side_by_side

DOCS = Path(__file__).parent
sys.path.insert(0, str(DOCS.parent / "tests"))
from calculix_plate import CCX, Plate, plunge_force  # noqa: E402

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
    def above(cls, side: float, elements: int, x: float = 0.0) -> Press:
        """Return a tool that touches the flat sheet at (x, 0)."""
        model = SheetModel(
            SheetMesh((side, side), (elements, elements), THICKNESS),
            ALUMINIUM,
            SheetSettings(window=0.02),
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


def _row(name: str, values: np.ndarray, digits: int = 1) -> str:
    return f"| {name} | " + " | ".join(f"{value:.{digits}f}" for value in values) + " |\n"


def shallow_table() -> str:
    """Return forces of a shallow plunge over the mesh, and CalculiX."""
    text = "| | " + " | ".join(f"{d} mm" for d in SHALLOW) + " |\n" + "|---" * 5 + "|\n"
    for elements in (10, 20, 30, 40):
        name = f"elements of {50.0 / elements:.3g} mm"
        text += _row(name, plunge_curve(0.05, elements, SHALLOW))
    solid = calculix_curve()
    return text + ("" if solid is None else _row("**CalculiX**, C3D8I solids", solid))


def deep_table() -> str:
    """Return forces of a deep plunge over the mesh, and the time."""
    text = "| | " + " | ".join(f"{d:g} mm" for d in DEEP) + " | s |\n" + "|---" * 6 + "|\n"
    for elements in (20, 30, 40):
        start = time.process_time()
        forces = plunge_curve(0.1, elements, DEEP)
        seconds = time.process_time() - start
        text += _row(f"elements of {100.0 / elements:.3g} mm", np.append(forces, seconds), 0)
    return text


def cone_table() -> str:
    """Return mean forces of three contours of a small cone over the mesh, beside Aerens' law."""
    text = "| | F_z | F_r | positions | CPU s / position |\n|---|---|---|---|---|\n"
    for elements in (16, 20, 24):
        press = Press.above(0.08, elements, 0.02)
        start = time.process_time()
        for depth in (1e-3, 2e-3, 3e-3):
            radius = 0.02 - depth
            angles = np.linspace(0.0, 2.0 * np.pi, round(2.0 * np.pi * radius / 3e-3) + 1)
            forces = []
            for k, angle in enumerate(angles):
                at = np.array([radius * np.cos(angle), radius * np.sin(angle), -depth])
                force = press.to(at, everywhere=k % 5 == 0)
                inward = -np.array([np.cos(angle), np.sin(angle), 0.0])
                forces.append([force[2], force @ inward])
        seconds = time.process_time() - start
        axial, radial = np.mean(forces[5:-5], axis=0)
        name = f"elements of {80.0 / elements:.3g} mm"
        text += f"| {name} | {axial:.0f} | {radial:.0f} | {press.solutions}"
        text += f" | {seconds / press.solutions:.2f} |\n"
    strength = tensile_strength(ALUMINIUM)
    scallop = scallop_height(1e-3, np.deg2rad(45.0), 2.0 * RADIUS)
    axial, radial = steady_force(strength, THICKNESS, 2.0 * RADIUS, scallop, np.deg2rad(45.0))
    return (
        text + f"| Aerens' law, R_m {1e-6 * strength:.0f} MPa | {axial:.0f} | {radial:.0f} | | |\n"
    )


def picture() -> None:
    """Draw the formed sheet of results/cone_fem, where that case has been run."""
    folder = DOCS.parent / "results" / "cone_fem"
    if not (folder / "result.json").exists():
        print(f"{folder}: not there; the picture stays as it is")
        return
    pieces = read_run(folder).workpieces
    cut, fields = workpiece_figures.cut(pieces), workpiece_figures.fields(pieces)
    cut.update_layout(width=500, height=420)
    fields.update_layout(width=900, height=420, updatemenus=[])
    save_side_by_side([cut, fields], DOCS / "figures" / "cone_fem.png")


def main() -> None:
    """Fill the page's tables and draw its picture."""
    page = (DOCS / "sheet_fem.md.in").read_text(encoding="utf-8")
    for name, table in (("shallow", shallow_table), ("deep", deep_table), ("cone", cone_table)):
        print(name, flush=True)
        page = page.replace(f"@{name}@\n", table())
    (DOCS / "sheet_fem.md").write_text(page, encoding="utf-8")
    picture()


if __name__ == "__main__":
    main()
