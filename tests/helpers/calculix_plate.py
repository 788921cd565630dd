"""A clamped square plate under a central rigid sphere, in CalculiX: solid elements, one quarter.

Units of the deck: mm, N, MPa.
"""

import re
import shutil
import subprocess
from dataclasses import dataclass
from pathlib import Path

import numpy as np

CCX = shutil.which("ccx")


@dataclass(frozen=True)
class Plate:
    """A plate under a sphere, and its division into elements.

    Attributes:
        side, thickness: Sides of the plate and its thickness [mm].
        radius: Radius of the sphere [mm].
        plunge: Depth of the sphere from first touch [mm].
        elements: Number along half a side, growing outwards.
        layers: Number over the thickness.
        finest: Side of the elements in the middle [mm].
        increment: Largest step of the sphere, as a part of its plunge.
    """

    side: float = 50.0
    thickness: float = 1.0
    radius: float = 5.0
    plunge: float = 1.0
    elements: int = 24
    layers: int = 4
    finest: float = 0.35
    increment: float = 0.1


def plunge_force(
    plate: Plate, curve: list[tuple[float, float]], E: float, nu: float, folder: Path
) -> tuple[np.ndarray, np.ndarray]:
    """Return plunges [mm] and forces [N] of all increments.

    Args:
        plate: Geometry and fineness.
        curve: Yield stress [MPa] over equivalent plastic strain.
        E: Young's modulus [MPa].
        nu: Poisson's ratio.
        folder: Folder in which the deck is written and run.
    """
    values = solved_forces("plate", _deck(plate, curve, E, nu), folder)
    return plate.plunge * values[:, 0], -4.0 * values[:, 3]


def solved_forces(name: str, deck: str, folder: Path) -> np.ndarray:
    """Return times and total forces fx, fy, fz of all increments of a deck, (n, 4)."""
    (folder / f"{name}.inp").write_text(deck, encoding="ascii")
    done = subprocess.run(
        [str(CCX), name], cwd=folder, capture_output=True, text=True, timeout=1800
    )
    text = (folder / f"{name}.dat").read_text()
    found = re.findall(r"force \(fx,fy,fz\).*time\s+(\S+)\s+(\S+)\s+(\S+)\s+(\S+)", text)
    if not found:
        raise RuntimeError(done.stdout[-2000:])
    return np.array(found, dtype=float)


def _graded(plate: Plate) -> np.ndarray:
    """Return places 0 .. side/2 whose distances grow by a constant factor."""
    from scipy.optimize import brentq

    steps = np.arange(plate.elements)

    def length(factor: float) -> float:
        return float(np.sum(plate.finest * factor**steps)) - 0.5 * plate.side

    factor = brentq(length, 1.0 + 1e-9, 2.0)
    return np.concatenate([[0.0], np.cumsum(plate.finest * factor**steps)])


def _grid(points: np.ndarray, first: int) -> tuple[list[str], np.ndarray]:
    """Return node lines and numbers of a block of points (nx, ny, nz, 3)."""
    numbers = first + np.arange(np.prod(points.shape[:3])).reshape(points.shape[:3])
    lines = [
        f"{n},{x:.9g},{y:.9g},{z:.9g}"
        for n, (x, y, z) in zip(numbers.ravel(), points.reshape(-1, 3), strict=True)
    ]
    return lines, numbers


def _bricks(n: np.ndarray, first: int) -> tuple[list[str], np.ndarray]:
    corners = [
        n[:-1, :-1, :-1],
        n[1:, :-1, :-1],
        n[1:, 1:, :-1],
        n[:-1, 1:, :-1],
        n[:-1, :-1, 1:],
        n[1:, :-1, 1:],
        n[1:, 1:, 1:],
        n[:-1, 1:, 1:],
    ]
    shape = corners[0].shape
    numbers = first + np.arange(np.prod(shape)).reshape(shape)
    table = np.stack(corners, axis=-1).reshape(-1, 8)
    lines = [
        f"{e}," + ",".join(map(str, row)) for e, row in zip(numbers.ravel(), table, strict=True)
    ]
    return lines, numbers


def _list(numbers: np.ndarray) -> str:
    flat = numbers.ravel()
    return "\n".join(",".join(map(str, flat[i : i + 12])) for i in range(0, len(flat), 12))


def _deck(plate: Plate, curve: list[tuple[float, float]], E: float, nu: float) -> str:
    places = _graded(plate)
    height = np.linspace(-plate.thickness, 0.0, plate.layers + 1)
    block = np.stack(np.meshgrid(places, places, height, indexing="ij"), axis=-1)
    nodes, n = _grid(block, 1)
    bricks, e = _bricks(n, 1)
    # The sphere's quarter cap, as the picture of a square grid seen from its centre.
    angle = np.tan(np.linspace(0.0, np.deg2rad(40.0), 20))
    u, v = np.meshgrid(angle, angle, indexing="ij")
    ray = np.stack([u, v, -np.ones_like(u)], axis=-1)
    ray /= np.linalg.norm(ray, axis=-1, keepdims=True)
    cap = ray[:, :, None, :] * np.array([plate.radius, plate.radius - 1.0])[None, None, :, None]
    cap = cap + np.array([0.0, 0.0, plate.radius])
    cap = cap[:, :, ::-1]  # outer face last, so that it is the bricks' upper face
    tool_nodes, tn = _grid(cap, 100001)
    # The cap's local up is down in space: turn the bricks over to keep them right-handed.
    tool_bricks, _ = _bricks(tn.transpose(1, 0, 2), 100001)
    clamped = np.unique(np.concatenate([n[-1].ravel(), n[:, -1].ravel()]))
    plastic = "\n".join(f"{stress:.6g},{strain:.6g}" for strain, stress in curve)
    newline = "\n"
    return f"""*NODE, NSET=NPLATE
{newline.join(nodes)}
*NODE, NSET=NTOOL
{newline.join(tool_nodes)}
*ELEMENT, TYPE=C3D8I, ELSET=PLATE
{newline.join(bricks)}
*ELEMENT, TYPE=C3D8, ELSET=TOOL
{newline.join(tool_bricks)}
*NSET, NSET=CLAMPED
{_list(clamped)}
*NSET, NSET=X0
{_list(n[0])}
*NSET, NSET=Y0
{_list(n[:, 0])}
*ELSET, ELSET=TOP
{_list(e[:, :, -1])}
*SURFACE, NAME=STOP, TYPE=ELEMENT
TOP,S2
*SURFACE, NAME=STOOL, TYPE=ELEMENT
TOOL,S2
*MATERIAL, NAME=METAL
*ELASTIC
{E},{nu}
*PLASTIC
{plastic}
*MATERIAL, NAME=HARD
*ELASTIC
210000,0.3
*SOLID SECTION, ELSET=PLATE, MATERIAL=METAL
*SOLID SECTION, ELSET=TOOL, MATERIAL=HARD
*BOUNDARY
CLAMPED,1,3
X0,1,1
Y0,2,2
NTOOL,1,2
*SURFACE INTERACTION, NAME=TOUCH
*SURFACE BEHAVIOR, PRESSURE-OVERCLOSURE=LINEAR
1.E6
*CONTACT PAIR, INTERACTION=TOUCH, TYPE=SURFACE TO SURFACE
STOP,STOOL
*STEP, NLGEOM, INC=400
*STATIC
{0.2 * plate.increment:g},1.,1.E-5,{plate.increment}
*BOUNDARY
NTOOL,3,3,{-plate.plunge}
*NODE PRINT, NSET=NTOOL, TOTALS=ONLY
RF
*END STEP
"""
