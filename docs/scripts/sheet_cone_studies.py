"""Studies of a small cone without a robot, each a Markdown table of docs/sheet_fem.md."""

from __future__ import annotations

import time
from collections.abc import Iterable, Iterator

import numpy as np

from coupling.sheet_fem.forming import SheetSettings
from coupling.sheet_fem.mesh import limit_of_force
from docs.scripts.page import table
from docs.scripts.sheet_studies import RADIUS, Press

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
