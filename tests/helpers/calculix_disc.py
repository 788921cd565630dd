"""A clamped round disc under a central rigid sphere, in CalculiX: solid elements around an axis.

Units of the deck: mm, N, MPa.
"""

from collections.abc import Iterable
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from calculix_plate import solved_forces

# CalculiX computes a sector of two degrees.
_SECTORS = 180.0


@dataclass(frozen=True)
class Disc:
    """A disc under a sphere, and its division into elements.

    Attributes:
        edge, thickness: Radius of the clamp and thickness of the disc [mm].
        radius: Radius of the sphere [mm].
        plunge: Depth of the sphere from first touch [mm].
        elements: Number along the radius.
        layers: Number over the thickness.
        increments: Number of equal steps of the sphere.
    """

    edge: float = 18.0
    thickness: float = 1.63
    radius: float = 6.33
    plunge: float = 5.0
    elements: int = 60
    layers: int = 4
    increments: int = 50


def disc_force(
    disc: Disc, curve: Iterable[tuple[float, float]], E: float, nu: float, folder: Path
) -> tuple[np.ndarray, np.ndarray]:
    """Return plunges [mm] and forces [N] of all increments; arguments as of `plunge_force`."""
    values = solved_forces("disc", _deck(disc, curve, E, nu), folder)
    return disc.plunge * values[:, 0], -_SECTORS * values[:, 2]


def _deck(disc: Disc, curve: Iterable[tuple[float, float]], E: float, nu: float) -> str:
    across = np.linspace(0.0, disc.edge, 2 * disc.elements + 1)
    height = np.linspace(-disc.thickness, 0.0, 2 * disc.layers + 1)
    sheet, numbers = _nodes(*np.meshgrid(across, height, indexing="ij"), 1)
    # A quarter of a ring, stiff and thick enough not to bend, stands for the sphere.
    angle = np.deg2rad(np.linspace(-90.0, -5.0, 121))
    rings = np.linspace(disc.radius - 1.5, disc.radius, 3)
    x, y = np.outer(rings, np.cos(angle)), disc.radius + np.outer(rings, np.sin(angle))
    tool, places = _nodes(np.maximum(x, 0.0), y, 1 + numbers.max())
    solids, top = _quads(numbers, 1)
    shell, _ = _quads(places, 1 + len(solids))
    return "\n".join(
        [
            *("*NODE, NSET=ALL", *sheet, *tool),
            *("*ELEMENT, TYPE=CAX8R, ELSET=SHEET", *solids),
            *("*ELEMENT, TYPE=CAX8R, ELSET=TOOL", *shell),
            *_set("AXIS", numbers[0]),
            *_set("CLAMP", numbers[-1]),
            *_set("SPHERE", places),
            *("*SURFACE, NAME=FACE, TYPE=ELEMENT", *(f"{e}, S3" for e in top)),
            "*SURFACE, NAME=ROUND, TYPE=ELEMENT",
            *(f"{1 + len(solids) + e}, S2" for e in range(len(shell))),
            *("*MATERIAL, NAME=METAL", "*ELASTIC", f"{E}, {nu}", "*PLASTIC"),
            *(f"{stress:.6f}, {strain:.8g}" for strain, stress in curve),
            *("*MATERIAL, NAME=HARD", "*ELASTIC", "2.1e7, 0.3"),
            "*SOLID SECTION, ELSET=SHEET, MATERIAL=METAL",
            "*SOLID SECTION, ELSET=TOOL, MATERIAL=HARD",
            *("*SURFACE INTERACTION, NAME=TOUCH", "*SURFACE BEHAVIOR, PRESSURE-OVERCLOSURE=LINEAR"),
            "2e5, 1.0",
            *("*CONTACT PAIR, INTERACTION=TOUCH, TYPE=SURFACE TO SURFACE", "FACE, ROUND"),
            *("*BOUNDARY", "CLAMP, 1, 2", "AXIS, 1, 1", "SPHERE, 1, 1"),
            *("*STEP, NLGEOM, INC=5000", "*STATIC"),
            f"{1 / disc.increments}, 1, 1e-6, {1 / disc.increments}",
            *("*BOUNDARY", f"SPHERE, 2, 2, {-disc.plunge}"),
            *("*NODE PRINT, NSET=SPHERE, TOTALS=ONLY", "RF", "*END STEP", ""),
        ]
    )


def _nodes(x: np.ndarray, y: np.ndarray, first: int) -> tuple[list[str], np.ndarray]:
    """Return lines and numbers of a grid of corners and middles of sides, 0 in those of elements."""
    numbers = np.zeros(x.shape, dtype=int)
    used = np.ones(x.shape, dtype=bool)
    used[1::2, 1::2] = False
    numbers[used] = first + np.arange(np.count_nonzero(used))
    places = zip(numbers[used], x[used], y[used], strict=True)
    return [f"{n}, {a:.9g}, {b:.9g}, 0" for n, a, b in places], numbers


def _quads(n: np.ndarray, first: int) -> tuple[list[str], list[int]]:
    """Return the elements of a grid, and those of its last row of the second direction."""
    lines: list[str] = []
    last: list[int] = []
    for i in range(0, n.shape[0] - 1, 2):
        for j in range(0, n.shape[1] - 1, 2):
            corners = (n[i, j], n[i + 2, j], n[i + 2, j + 2], n[i, j + 2])
            middles = (n[i + 1, j], n[i + 2, j + 1], n[i + 1, j + 2], n[i, j + 1])
            number = first + len(lines)
            lines.append(", ".join(map(str, (number, *corners, *middles))))
            if j == n.shape[1] - 3:
                last.append(number)
    return lines, last


def _set(name: str, numbers: np.ndarray) -> list[str]:
    return [f"*NSET, NSET={name}", *(f"{n}," for n in numbers[numbers > 0].ravel())]
