"""The computed sheet and the force law, against CalculiX and NUMISHEET 2014's benchmark 3.

The benchmark's whole run takes minutes: its numbers are read from the page that the run writes.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cache

import numpy as np

from docs.scripts.make_measured_sheet import columns, distances, rows
from docs.scripts.page_table import PageTable
from docs.scripts.runs import example
from docs.scripts.sheet_studies import SHALLOW, calculix_curve, plunge_curve
from docs.scripts.trust_comparison import Against, Comparison

SIDE = 50.0  # of the plate [mm]
ELEMENTS = (40, 10)  # along it: as fine as the page on the sheet has them, and as examples are
STEADY = "700 to 1330 s"


@dataclass(frozen=True)
class Benchmark:
    """What was given of the measured cone.

    Attributes:
        circles: Radius and height of the TCP's circles, deepest first [m], (n, 2).
        thickness: Of the sheet [m].
        radius: Of the tool [m].
        edge: Half side of the sheet inside the clamps [m].
        angle: Of the wall [rad].
        depth: Of the cone [m].
    """

    circles: np.ndarray
    thickness: float
    radius: float
    edge: float
    angle: float
    depth: float


@cache
def benchmark() -> Benchmark:
    """Return it from its case."""
    case = example("bm3", tool_path={"sample_s": 0.1})
    points = case.task.part.coordinates(case.desired.position[0])
    depths = np.unique(points[:, 2].round(6))
    levels = [points[np.abs(points[:, 2] - depth) < 1e-7] for depth in depths[depths < 0.0]]
    circles = [
        (np.linalg.norm(level[:, :2], axis=1).max(), level[0, 2])
        for level in levels
        if len(level) > 10
    ]
    process, cone = case.resolved["process"], case.resolved["tool_path"]
    return Benchmark(
        np.array(circles),
        process["sheet_thickness_m"],
        0.5 * process["tool_diameter_m"],
        0.5 * process["sheet_size_m"][0],
        np.deg2rad(cone["wall_angle_deg"]),
        cone["depth_m"],
    )


@dataclass(frozen=True)
class Plunge:
    """Force of a tool that is pushed into a clamped plate.

    Attributes:
        side: Of the plate [mm].
        depths: [mm], (n,).
        forces: By the number of elements along the plate [N], (n,).
        solid: CalculiX's, of solid elements [N], (n,).
    """

    side: float
    depths: np.ndarray
    forces: dict[int, np.ndarray]
    solid: np.ndarray

    def compared(self, elements: int) -> Comparison:
        """Return the deviation at the largest depth."""
        ours, other = self.forces[elements][-1], self.solid[-1]
        what = f"force into a plate, elements of {self.side / elements:.3g} mm"
        words = f"{ours - other:+.0f} of {other:.0f} N"
        return Comparison(what, Against.PROGRAM, ours - other, other, words)


@cache
def plunge() -> Plunge:
    """Run the plunge, in CalculiX too where that is installed; else what it last said is read."""
    forces = {count: plunge_curve(1e-3 * SIDE, count, SHALLOW) for count in ELEMENTS}
    solid = calculix_curve()
    if solid is None:
        table = PageTable.of("sheet_fem", "shallow")
        solid = np.array([table.number("CalculiX", f"{depth} mm") for depth in SHALLOW])
    return Plunge(SIDE, SHALLOW, forces, solid)


@dataclass(frozen=True)
class AxialForce:
    """Axial force on the benchmark's tool, means in windows of its time [N].

    Attributes:
        spans: Windows [s], (n, 2).
        measured, ours, solid: Measured, of `sheet-fem` and of the authors' solid elements, (n,).
        spread: 5th and 95th percentile of what was measured, (n, 2).
        law: Aerens' steady force.
    """

    spans: np.ndarray
    measured: np.ndarray
    ours: np.ndarray
    solid: np.ndarray
    spread: np.ndarray
    law: float

    @classmethod
    def published(cls) -> AxialForce:
        """Read it from the page on the measured sheet and from the measurement."""
        table = PageTable.of("measured_sheet", "force")
        windows = [row for row in rows("force_windows") if row["series"] == "exp_Fz"]
        spans = [(row["t0_s"], row["t1_s"]) for row in windows]
        measured, ours, solid = (
            np.array([table.number(f"{first} to {last} s", column) for first, last in spans])
            for column in ("F_z measured", "F_z here", "solid FE")
        )
        return cls(
            np.array(spans, dtype=float),
            measured,
            ours,
            solid,
            np.array([(row["p5_N"], row["p95_N"]) for row in windows], dtype=float),
            PageTable.of("measured_sheet", "law").number("benchmark 3", "Aerens' law"),
        )


def steady_force() -> Comparison:
    """Return the axial force in the steady state, computed by `sheet-fem`."""
    return _force("axial force, sheet-fem", "force", STEADY, "F_z here")


def steady_force_of_solids() -> Comparison:
    """Return the same by the authors' solid elements."""
    return _force("axial force, solid elements of others", "force", STEADY, "solid FE")


def force_law() -> Comparison:
    """Return the same by Aerens' law."""
    return _force("axial force, Aerens' law", "law", "benchmark 3", "Aerens' law")


def _force(what: str, part: str, row: str, column: str) -> Comparison:
    table = PageTable.of("measured_sheet", part)
    (measured,) = (name for name in table.lines[0] if name in ("F_z measured", "measured F_z"))
    ours, theirs = (table.number(row, name) for name in (column, measured))
    words = f"{ours - theirs:+.0f} of {theirs:.0f} N"
    return Comparison(what, Against.MEASUREMENT, ours - theirs, theirs, words)


def thinning() -> Comparison:
    """Return the smallest thickness, as a part of the thinning."""
    table = PageTable.of("measured_sheet", "shape")
    measured, ours = (table.number("smallest thickness", name) for name in ("measured", "here"))
    thinned = 1e3 * benchmark().thickness - measured
    words = f"{ours - measured:+.3f} of {thinned:.3f} mm"
    return Comparison("thinning of the sheet", Against.MEASUREMENT, ours - measured, thinned, words)


def shape() -> Comparison:
    """Return the rms distance of the profiles, beside that of the commanded one."""
    table = PageTable.of("measured_sheet", "shape")
    ours = [_rms_in(table.cell(f"distance of profiles, {way}", "here")) for way in ("RD", "TD")]
    line = commanded_profile()
    other = []
    for way in ("RD", "TD"):
        points = columns(f"profile_{way}")
        apart = distances(points[np.abs(points[:, 0]) < line[-1, 0]], line)
        other.append(1e3 * float(np.sqrt(np.mean(apart**2))))
    found, of = float(np.mean(ours)), float(np.mean(other))
    words = f"{found:.1f} of {of:.1f} mm rms"
    return Comparison("departure of the shape", Against.MEASUREMENT, found, of, words)


def _rms_in(cell: str) -> float:
    return float(cell.split("rms ")[1].split(",")[0])


def commanded_profile() -> np.ndarray:
    """Return the midsurface that the commanded path would leave in a sheet that follows it, (n, 2).

    Flat at z = 0 and at the bottom; the wall touches the tool's sphere where it has the wall's slope.
    """
    given = benchmark()
    half = 0.5 * given.thickness
    out, down = (given.radius + half) * np.array([np.sin(given.angle), np.cos(given.angle)])
    wall = given.circles + np.array([out, given.radius - down + half])
    wall = wall[wall[:, 1] < 0.0]
    top = [wall[-1, 0] - wall[-1, 1] / np.tan(given.angle), 0.0]
    right = np.vstack([given.circles[0], wall, top, [given.edge, 0.0]])
    whole: np.ndarray = np.vstack([right[::-1] * [-1.0, 1.0], right])
    return whole
