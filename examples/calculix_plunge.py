"""A process in CalculiX: an elastic sheet, clamped all around, is pushed in at its centre.

Run by the process `external` in a fresh folder: reads path.csv (part frame: the sheet at rest is z =
0), writes the deck plunge.inp, runs `ccx` and writes wrench.csv.  A quarter of the sheet is meshed
with eight-node shells; the node under the tool follows the TCP, large deflections included.  The
sheet stays elastic, so that its answer has a closed form for small depths.

    python calculix_plunge.py
"""

from __future__ import annotations

import re
import subprocess
import sys
from pathlib import Path

import numpy as np

SIDE, THICKNESS = 0.2, 1e-3  # of the square sheet [m]
YOUNG, POISSON = 70e9, 0.33  # aluminium [Pa, 1]
ELEMENTS = 8  # along half a side

DECK = """*NODE, NSET=ALL
{nodes}
*ELEMENT, TYPE=S8R, ELSET=SHEET
{elements}
*NSET, NSET=CLAMPED
{clamped}
*NSET, NSET=X_ZERO
{x_zero}
*NSET, NSET=Y_ZERO
{y_zero}
*MATERIAL, NAME=ALUMINIUM
*ELASTIC
{young:g}, {poisson:g}
*SHELL SECTION, ELSET=SHEET, MATERIAL=ALUMINIUM
{thickness:g}
*BOUNDARY
CLAMPED, 1, 6
X_ZERO, 1
X_ZERO, 5, 6
Y_ZERO, 2
Y_ZERO, 4
Y_ZERO, 6
*AMPLITUDE, NAME=TOOL
{amplitude}
*STEP, NLGEOM, INC={increments}
*STATIC, DIRECT
{period:.12g}, {duration:.12g}
*BOUNDARY, AMPLITUDE=TOOL
{centre}, 3, 3, 1.0
*NODE PRINT, NSET=TOUCHED, TOTALS=ONLY
RF
*END STEP
"""


def mesh() -> tuple[dict[tuple[int, int], int], list[list[int]]]:
    """Return node numbers by position in units of half an element, and the elements' nodes."""
    size = 2 * ELEMENTS
    places = [
        (i, j) for j in range(size + 1) for i in range(size + 1) if not (i % 2 == 1 and j % 2 == 1)
    ]
    number = {place: k for k, place in enumerate(places, start=1)}
    ring = [(0, 0), (2, 0), (2, 2), (0, 2), (1, 0), (2, 1), (1, 2), (0, 1)]
    elements = [
        [number[2 * i + a, 2 * j + b] for a, b in ring]
        for j in range(ELEMENTS)
        for i in range(ELEMENTS)
    ]
    return number, elements


def deck(time: np.ndarray, depth: np.ndarray) -> str:
    """Return the input of CalculiX for depths [m] of the sheet's centre at evenly spaced times [s]."""
    number, elements = mesh()
    size = 2 * ELEMENTS
    step = 0.5 * SIDE / size
    text = DECK.format(
        nodes="\n".join(f"{k}, {i * step:.9g}, {j * step:.9g}, 0" for (i, j), k in number.items()),
        elements="\n".join(
            f"{k}, {', '.join(map(str, nodes))}" for k, nodes in enumerate(elements, start=1)
        ),
        clamped=_column(k for (i, j), k in number.items() if size in (i, j)),
        x_zero=_column(k for (i, j), k in number.items() if i == 0 and j < size),
        y_zero=_column(k for (i, j), k in number.items() if j == 0 and i < size),
        young=YOUNG,
        poisson=POISSON,
        thickness=THICKNESS,
        amplitude="\n".join(
            f"{t:.12g}, {-d:.12g}" for t, d in zip(time - time[0], depth, strict=True)
        ),
        increments=2 * len(time),
        period=time[1] - time[0],
        duration=time[-1] - time[0],
        centre=number[0, 0],
    )
    return text.replace("*MATERIAL", f"*NSET, NSET=TOUCHED\n{number[0, 0]}\n*MATERIAL", 1)


def _column(numbers: object) -> str:
    return "\n".join(map(str, numbers))  # type: ignore[call-overload]


def forces(printed: str) -> np.ndarray:
    """Return the force on the tool after each increment [N], from CalculiX's .dat file."""
    totals = re.findall(r"total force.*\n\s*\n\s*(\S+)\s+(\S+)\s+(\S+)", printed)
    return -4.0 * np.array([float(total[2]) for total in totals])  # four quarters


def main() -> int:
    """Answer the path in the working folder; return the exit status."""
    path = np.genfromtxt("path.csv", delimiter=",", names=True)
    time, depth = path["time"], np.maximum(-path["z"], 0.0)
    if depth[0] > 0.0:
        print("the path must begin above the sheet", file=sys.stderr)
        return 2
    Path("plunge.inp").write_text(deck(time, depth), encoding="ascii")
    solved = subprocess.run(["ccx", "plunge"])
    if solved.returncode != 0:
        return solved.returncode
    force = forces(Path("plunge.dat").read_text(encoding="ascii"))
    if len(force) != len(time) - 1:
        print(f"CalculiX stopped after {len(force)} of {len(time) - 1} increments", file=sys.stderr)
        return 1
    wrench = np.zeros((len(time), 7))
    wrench[:, 0] = time
    wrench[1:, 3] = np.maximum(force, 0.0)  # the tool cannot pull
    header = "time,fx,fy,fz,mx,my,mz"
    np.savetxt("wrench.csv", wrench, delimiter=",", header=header, comments="", fmt="%.17g")
    return 0


if __name__ == "__main__":
    sys.exit(main())
