"""Studies of a small cone without a robot, each a Markdown table of docs/sheet_fem.md."""

from __future__ import annotations

import time
from collections.abc import Iterable, Iterator

import numpy as np

from coupling.process.isf_force_law import scallop_height, steady_force
from coupling.sheet_fem.forming import SheetSettings
from coupling.sheet_fem.material import tensile_strength
from coupling.sheet_fem.mesh import limit_of_force
from docs.scripts.page import table
from docs.scripts.sheet_studies import ALUMINIUM, RADIUS, THICKNESS, WINDOW, Press

WALL = np.deg2rad(45.0)


def contours(
    press: Press, radius: float, depths: Iterable[float], spacing: float = 3e-3
) -> Iterator[np.ndarray]:
    """Form contours of a cone and yield the mean forces in each, but for its first and last sixth.

    Args:
        press: Above the start.
        radius: Of the TCP's path at the sheet's plane [m].
        depths: Of the contours [m].
        spacing: Of positions [m].

    Yields:
        Force on the tool out of the sheet, towards the axis and against the motion [N], (3,).
    """
    for depth in depths:
        r = radius - depth / np.tan(WALL)
        angles = np.linspace(0.0, 2.0 * np.pi, round(2.0 * np.pi * r / spacing) + 1)
        forces = []
        for angle in angles:
            outward = np.array([np.cos(angle), np.sin(angle), 0.0])
            ahead = np.array([-np.sin(angle), np.cos(angle), 0.0])
            force = press.to(r * outward - [0.0, 0.0, depth], everywhere=False)
            forces.append([force[2], -force @ outward, -force @ ahead])
        sixth = len(forces) // 6
        yield np.mean(forces[sixth:-sixth], axis=0)


def aerens() -> tuple[float, float]:
    """Return the axial and radial force of Aerens' law for the cone's wall [N]."""
    scallop = scallop_height(1e-3, WALL, 2.0 * RADIUS)
    return steady_force(tensile_strength(ALUMINIUM), THICKNESS, 2.0 * RADIUS, scallop, WALL)


def cone_table() -> str:
    """Return mean forces of the third contour of a small cone over the mesh, beside Aerens' law."""
    rows = []
    for elements in (20, 32, 40):
        press = Press.above(0.08, elements, 0.02)
        start = time.process_time()
        *_, (axial, radial, _) = contours(press, 0.02, (1e-3, 2e-3, 3e-3))
        seconds = (time.process_time() - start) / press.solutions
        figures = (f"{axial:.0f}", f"{radial:.0f}", f"{press.solutions}", f"{seconds:.2f}")
        rows.append((f"elements of {80.0 / elements:.3g} mm", *figures))
    axial, radial = aerens()
    strength = 1e-6 * tensile_strength(ALUMINIUM)
    law = f"Aerens' law, R_m {strength:.0f} MPa"
    rows.append((law, f"{axial:.0f}", f"{radial:.0f}", "", ""))
    return table(("", "F_z", "F_r", "positions", "CPU s / position"), rows)


def friction_table() -> str:
    """Return mean forces of the third contour of a small cone over the coefficient of friction."""
    rows = []
    without = 0.0
    for friction in (0.0, 0.05, 0.1, 0.2):
        press = Press.above(0.08, 32, 0.02, SheetSettings(window=WINDOW, friction=friction))
        *_, (axial, radial, tangential) = contours(press, 0.02, (1e-3, 2e-3, 3e-3))
        if friction == 0.0:
            without = tangential
        share = (tangential - without) / axial
        figures = (f"{axial:.0f}", f"{radial:.1f}", f"{tangential:.0f}", f"{share:.3f}")
        rows.append((f"{friction:g}", *figures))
    return table(("mu", "F_z", "F_r", "F_t", "(F_t - F_t without) / F_z"), rows)


# Of the study of fineness: thickness [mm], elements along 80 mm, positions and window [mm].
FINENESS = (
    *((0.5, elements, 2.5, 10.0) for elements in (32, 40, 60)),
    *((1.0, elements, 2.5, 10.0) for elements in (20, 32, 40, 60)),
    *((2.0, elements, 2.5, 10.0) for elements in (32, 40, 60)),
    (1.0, 40, 0.75, 10.0),
    (1.0, 40, 2.5, 15.0),
    (1.0, 40, 2.5, 80.0),
)


def fineness_table() -> str:
    """Return the forces in three contours on the plate over thickness, elements, positions, window."""
    rows: list[tuple[str, ...]] = []
    for thickness, elements, spacing, window in FINENESS:
        settings = SheetSettings(window=1e-3 * window, opening_radius=0.024)
        press = Press.above(0.08, elements, 0.02, settings, 1e-3 * thickness)
        start = time.process_time()
        found = [f[0] for f in contours(press, 0.02, (1e-3, 2e-3, 3e-3), 1e-3 * spacing)]
        seconds = (time.process_time() - start) / press.solutions
        limit = limit_of_force(0.08 / elements, RADIUS, 1e-3 * thickness)
        name = "whole sheet" if window >= 80.0 else f"{window:g} mm"
        rows.append(
            (
                f"{thickness:g} mm",
                f"{80.0 / elements:.3g} mm",
                f"{spacing:g} mm",
                name,
                ", ".join(f"{force:.0f}" for force in found),
                f"{1.0 / limit:.3f}",
                ", ".join(f"{limit * force:.0f}" for force in found),
                f"{seconds:.2f}",
            )
        )
    head = ("sheet", "elements", "positions", "window", "F_z computed", "over its limit")
    return table((*head, "F_z stated", "CPU s / position"), rows)
