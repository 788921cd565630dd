"""Studies of the sheet alone, each a Markdown table of docs/sheet_fem.md."""

from __future__ import annotations

import sys
import tempfile
import time
from collections.abc import Iterable, Iterator
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np

from coupling.case import load_case
from coupling.process.isf_force_law import scallop_height, steady_force
from coupling.process.sheet.contact import Sphere
from coupling.process.sheet.forming import SheetModel, SheetSettings
from coupling.process.sheet.material import Material, tensile_strength
from coupling.process.sheet.mesh import SheetMesh
from coupling.process.sheet.process import SheetFem
from coupling.process.sheet.schedule import schedule
from coupling.process.sheet.shape import DEFLECTION

DOCS = Path(__file__).parent
EXAMPLE = DOCS.parent / "examples" / "cases" / "cone_fem.toml"
sys.path.insert(0, str(DOCS.parent / "tests"))
from calculix_plate import CCX, Plate, plunge_force  # noqa: E402

ALUMINIUM = Material(70e9, 0.33, 180e6, 0.00057, 0.229)
THICKNESS, RADIUS = 1e-3, 5e-3
SHALLOW = np.array([0.1, 0.2, 0.5, 1.0])  # [mm]
DEEP = np.array([1.0, 2.0, 3.0, 5.0])  # [mm]
WALL = np.deg2rad(45.0)


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


def contours(press: Press, radius: float, depths: Iterable[float]) -> Iterator[np.ndarray]:
    """Form contours of a cone and yield the mean forces in each.

    Args:
        press: Above the start.
        radius: Of the TCP's path at the sheet's plane [m].
        depths: Of the contours [m].

    Yields:
        Force on the tool out of the sheet, towards the axis and against the motion [N], (3,).
    """
    for depth in depths:
        r = radius - depth / np.tan(WALL)
        angles = np.linspace(0.0, 2.0 * np.pi, round(2.0 * np.pi * r / 3e-3) + 1)
        forces = []
        for k, angle in enumerate(angles):
            outward = np.array([np.cos(angle), np.sin(angle), 0.0])
            ahead = np.array([-np.sin(angle), np.cos(angle), 0.0])
            force = press.to(r * outward - [0.0, 0.0, depth], everywhere=k % 5 == 0)
            forces.append([force[2], -force @ outward, -force @ ahead])
        yield np.mean(forces[5:-5], axis=0)


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


def header(*names: str) -> str:
    """Return the first two lines of a table."""
    return "| " + " | ".join(names) + " |\n" + "|---" * len(names) + "|\n"


def row(name: str, values: Iterable[float], digits: int = 0) -> str:
    """Return a line of a table."""
    return f"| {name} | " + " | ".join(f"{value:.{digits}f}" for value in values) + " |\n"


def shallow_table() -> str:
    """Return forces of a shallow plunge over the mesh, and CalculiX."""
    text = header("", *[f"{d} mm" for d in SHALLOW])
    for elements in (10, 20, 30, 40):
        name = f"elements of {50.0 / elements:.3g} mm"
        text += row(name, plunge_curve(0.05, elements, SHALLOW), 1)
    solid = calculix_curve()
    return text + ("" if solid is None else row("**CalculiX**, C3D8I solids", solid, 1))


def deep_table() -> str:
    """Return forces of a deep plunge over the mesh, and the time."""
    text = header("", *[f"{d:g} mm" for d in DEEP], "s")
    for elements in (20, 30, 40):
        start = time.process_time()
        forces = plunge_curve(0.1, elements, DEEP)
        seconds = time.process_time() - start
        text += row(f"elements of {100.0 / elements:.3g} mm", np.append(forces, seconds))
    return text


def aerens() -> tuple[float, float]:
    """Return the axial and radial force of Aerens' law for the cone's wall [N]."""
    scallop = scallop_height(1e-3, WALL, 2.0 * RADIUS)
    return steady_force(tensile_strength(ALUMINIUM), THICKNESS, 2.0 * RADIUS, scallop, WALL)


def cone_table() -> str:
    """Return mean forces of the third contour of a small cone over the mesh, beside Aerens' law."""
    text = header("", "F_z", "F_r", "positions", "CPU s / position")
    for elements in (16, 20, 24):
        press = Press.above(0.08, elements, 0.02)
        start = time.process_time()
        *_, (axial, radial, _) = contours(press, 0.02, (1e-3, 2e-3, 3e-3))
        seconds = (time.process_time() - start) / press.solutions
        text += f"| elements of {80.0 / elements:.3g} mm | {axial:.0f} | {radial:.0f}"
        text += f" | {press.solutions} | {seconds:.2f} |\n"
    axial, radial = aerens()
    strength = 1e-6 * tensile_strength(ALUMINIUM)
    return text + f"| Aerens' law, R_m {strength:.0f} MPa | {axial:.0f} | {radial:.0f} | | |\n"


def friction_table() -> str:
    """Return mean forces of the third contour of a small cone over the coefficient of friction."""
    text = header("mu", "F_z", "F_r", "F_t", "(F_t - F_t without) / F_z")
    without = 0.0
    for friction in (0.0, 0.05, 0.1, 0.2):
        press = Press.above(0.08, 20, 0.02, SheetSettings(window=0.02, friction=friction))
        *_, (axial, radial, tangential) = contours(press, 0.02, (1e-3, 2e-3, 3e-3))
        if friction == 0.0:
            without = tangential
        text += f"| {friction:g} | {axial:.0f} | {radial:.1f} | {tangential:.0f}"
        text += f" | {(tangential - without) / axial:.3f} |\n"
    return text


# Of the study of the radial force: depth of contours to show [mm], all being 1 mm deep.
STEPS = (1, 2, 3, 5, 7, 9, 11)


def radial_table() -> str:
    """Return axial and radial force over the depth, free sheet and backing plate."""
    depths = 1e-3 * np.arange(1, STEPS[-1] + 1)
    text = header("", *[f"{depth} mm" for depth in STEPS])
    for name, opening, friction in (
        ("free sheet", None, 0.0),
        ("plate, hole of 24 mm radius", 0.024, 0.0),
        ("plate, mu 0.1", 0.024, 0.1),
    ):
        settings = SheetSettings(window=0.02, opening_radius=opening, friction=friction)
        press = Press.above(0.08, 32, 0.02, settings)
        found = []
        for force in contours(press, 0.02, depths):
            found.append([force[0], force[1], np.rad2deg(press.steepest())])
        axial, radial, slope = np.array(found)[np.array(STEPS) - 1].T
        text += row(f"{name}: F_z", axial) + row("F_r", radial)
        text += row("atan(F_r/F_z) [deg]", np.rad2deg(np.arctan2(radial, axial)))
        text += row("steepest slope of the sheet [deg]", slope)
    axial, radial = aerens()
    angle = np.rad2deg(np.arctan2(radial, axial))
    return (
        text
        + f"| Aerens' law: F_z {axial:.0f}, F_r {radial:.0f}, {angle:.0f} deg"
        + " |" * 8
        + "\n"
    )


def window_table() -> str:
    """Return what the example's window changes in two contours, against the whole sheet always."""
    text = EXAMPLE.read_text(encoding="utf-8")
    assert "depth_m        = 0.005" in text
    text = text.replace("depth_m        = 0.005", "depth_m        = 0.002")
    with tempfile.TemporaryDirectory() as folder:
        file = Path(folder) / "short.toml"
        file.write_text(text, encoding="utf-8")
        case = load_case(file)
    process = case.process
    assert isinstance(process, SheetFem)
    always = replace(
        process.schedule, everywhere=np.ones_like(process.schedule.everywhere, dtype=bool)
    )
    start = time.process_time()
    whole = replace(process, schedule=always).wrench(case.desired)
    full = time.process_time() - start
    peak = whole.peak_force
    assert whole.workpiece is not None
    shape = whole.workpiece.point_fields[DEFLECTION]
    text = header(
        "window, whole sheet", "force, rms", "force, max", "shape, rms", "shape, max", "CPU s"
    )
    points = case.part.coordinates(case.desired)
    spacing = case.resolved["process"]["position_m"]
    for window, every in ((0.02, 8), (0.02, 4), (0.03, 5)):
        model = SheetModel(
            process.model.mesh, ALUMINIUM, replace(process.model.settings, window=window)
        )
        plan = schedule(points, spacing, every)
        start = time.process_time()
        found = replace(process, model=model, schedule=plan).wrench(case.desired)
        seconds = time.process_time() - start
        error = np.linalg.norm((found.wrench - whole.wrench)[:, :3], axis=1) / peak
        assert found.workpiece is not None
        bend = found.workpiece.point_fields[DEFLECTION] - shape
        text += (
            f"| {1e3 * window:.0f} mm, every {every}th | {100 * np.sqrt(np.mean(error**2)):.1f} %"
        )
        text += f" | {100 * error.max():.1f} % | {1e6 * np.sqrt(np.mean(bend**2)):.0f} um"
        text += f" | {1e6 * np.abs(bend).max():.0f} um | {seconds:.0f} |\n"
    return text + f"| whole sheet always | 0 | 0 | 0 | 0 | {full:.0f} |\n"
