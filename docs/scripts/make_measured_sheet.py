"""Write the tables of docs/measured_sheet.md: make measured-sheet, half an hour."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cache

import numpy as np

from coupling.case.case import Case
from coupling.process.base import ProcessResponse
from coupling.process.isf_force_law import scallop_height, steady_force
from coupling.process.sheet_fem import THICKNESS
from docs.scripts.experiment import Page
from docs.scripts.page import table
from docs.scripts.runs import around_axis, example, measured_rows

TENSILE_STRENGTH = 198e6  # of the benchmark's sheet [Pa]
# Without a robot that moves, samples need not be denser than the positions [s].
SAMPLE = 0.065
STEADY = ("exp_Fz", 700.0, 1330.0)
PAGE = Page("measured_sheet")


def rows(name: str) -> list[dict[str, str]]:
    """Return the rows of a file of the measurement."""
    return measured_rows(f"numisheet2014_bm3/{name}")


def columns(name: str) -> np.ndarray:
    """Return a file of two columns of numbers [m], (n, 2)."""
    return 1e-3 * np.array([[float(value) for value in row.values()] for row in rows(name)])


@dataclass(frozen=True)
class Forming:
    """The force on the tool on the desired path, at equal distances.

    Attributes:
        time: Way in the sheet over the feed, which is the measurement's time [s], (n,).
        depth: Of the TCP [m], (n,).
        force: Axial, radial (towards the axis) and tangential (against the motion) [N], (n, 3).
    """

    time: np.ndarray
    depth: np.ndarray
    force: np.ndarray

    @classmethod
    def of(cls, case: Case, response: ProcessResponse) -> Forming:
        """Return it of an evaluation on the case's desired path."""
        part = case.task.part
        points = part.coordinates(case.desired.position[0])
        force = part.rotation.inv().apply(response.wrench.force[0])
        own = around_axis(points, force)
        moves = np.linalg.norm(np.diff(points, axis=0), axis=1)
        moves[np.minimum(points[:-1, 2], points[1:, 2]) > -1e-6] = 0.0  # in the air
        way = np.concatenate([[0.0], np.cumsum(moves)])
        lifted = int(np.argmin(points[:, 2] + 1e-9 * np.arange(len(points))[::-1])) + 1
        even = np.arange(0.0, way[lifted - 1], 5e-4)
        inside = slice(0, lifted)
        depth = np.interp(even, way[inside], -points[inside, 2])
        values = [np.interp(even, way[inside], column[inside]) for column in own.T]
        return cls(even / case.resolved["tool_path"]["feed_m_s"], depth, np.column_stack(values))

    def within(self, first: float, last: float) -> np.ndarray:
        """Return the forces in a window of time [s], (k, 3)."""
        found: np.ndarray = self.force[(self.time >= first) & (self.time < last)]
        return found


@cache
def stiff() -> tuple[Case, ProcessResponse]:
    """Return the case and its process on the desired path: what a stiff machine does."""
    case = example("bm3", tool_path={"sample_s": SAMPLE})
    return case, case.process.evaluate(case.desired)


@PAGE.part
def force() -> str:
    """Return the forces in the measurement's windows beside it and the authors' solid elements."""
    forming = Forming.of(*stiff())
    windows = rows("force_windows")
    mean = {(row["series"], row["t0_s"], row["t1_s"]): float(row["mean_N"]) for row in windows}
    lines = []
    for row in windows:
        if row["series"] != "exp_Fz":
            continue
        span = (row["t0_s"], row["t1_s"])
        first, last = (float(edge) for edge in span)
        depth = [1e3 * abs(float(np.interp(t, forming.time, forming.depth))) for t in (first, last)]
        axial, radial, tangential = forming.within(first, last).mean(axis=0)
        solid, solid_radial = mean["fe_Fz", *span], mean["fe_Fr", *span]
        measured = float(row["mean_N"])
        lines.append(
            (
                f"{first:.0f} to {last:.0f} s, {depth[0]:.1f} to {depth[1]:.1f} mm",
                f"{measured:.0f}",
                f"{axial:.0f} ({_beyond(axial, measured)})",
                f"{solid:.0f} ({_beyond(solid, measured)})",
                f"{radial / axial:.2f}",
                f"{solid_radial / solid:.2f}",
                f"{tangential / axial:.2f}",
                f"{mean['fe_Ft', *span] / solid:.2f}",
            )
        )
    head = ("time, depth", "F_z measured", "F_z here", "solid FE", "F_r/F_z here", "solid FE")
    return table((*head, "F_t/F_z here", "solid FE"), lines)


def _beyond(value: float, measured: float) -> str:
    return f"{100.0 * (value / measured - 1.0):+.0f} %"


@PAGE.part
def shape() -> str:
    """Return smallest thickness and the distance of the profiles from the measured ones."""
    _, response = stiff()
    assert response.workpiece is not None
    thickness = 1e3 * response.workpiece.cell_fields[THICKNESS]
    measured = 1e3 * columns("thickness")[:, 1]
    lines = [("smallest thickness", f"{measured.min():.3f} mm", f"{thickness.min():.3f} mm")]
    corners = response.workpiece.points
    side = round(np.sqrt(len(corners)))
    grid = corners.reshape(side, side, 3) - corners[0] * [0.0, 0.0, 1.0]
    cuts = {"RD": grid[:, side // 2][:, [0, 2]], "TD": grid[side // 2][:, [1, 2]]}
    for name, cut in cuts.items():
        points = columns(f"profile_{name}")
        points = points[np.abs(points[:, 0]) < cut[-1, 0]]
        apart = 1e3 * distances(points, cut)
        rms, most = float(np.sqrt(np.mean(apart**2))), apart.max()
        deepest, own = 1e3 * points[:, 1].min(), 1e3 * cut[:, 1].min()
        lines.append((f"deepest point, {name}", f"{deepest:.1f} mm", f"{own:.1f} mm"))
        lines.append((f"distance of profiles, {name}", "", f"rms {rms:.2f}, max {most:.2f} mm"))
    return table(("", "measured", "here"), lines)


def distances(points: np.ndarray, line: np.ndarray) -> np.ndarray:
    """Return the distances of points in a plane from a broken line, (n,).

    Example:
        >>> distances(np.array([[0.5, 0.1], [2.0, 0.0]]), np.array([[0.0, 0.0], [1.0, 0.0]]))
        array([0.1, 1. ])
    """
    start, along = line[:-1], np.diff(line, axis=0)
    away = points[:, None] - start
    share = np.clip(np.sum(away * along, axis=2) / np.sum(along**2, axis=1), 0.0, 1.0)
    nearest: np.ndarray = np.linalg.norm(away - share[..., None] * along, axis=2).min(axis=1)
    return nearest


@PAGE.part
def law() -> str:
    """Return Aerens' law against both measurements."""
    (measured,) = (
        float(row["mean_N"])
        for row in rows("force_windows")
        if (row["series"], float(row["t0_s"]), float(row["t1_s"])) == STEADY
    )
    thickness, diameter, step, angle = 1.63e-3, 12.66e-3, 0.5e-3, np.deg2rad(45.0)
    scallop = scallop_height(step, angle, diameter)
    axial, radial = steady_force(TENSILE_STRENGTH, thickness, diameter, scallop, angle)
    # [Bharti2024]: AA1050 of 1.22 mm, tool 10 mm, step 0.5 mm, 71 degrees; at 11 mm 381 +- 26 N.
    steep = np.deg2rad(71.0)
    other, _ = steady_force(1e6, 1.22e-3, 10e-3, scallop_height(step, steep, 10e-3), steep)
    return table(
        ("", "measured F_z", "Aerens' law", "F_r/F_z of the law"),
        (
            (
                "benchmark 3, steady, R_m 198 MPa",
                f"{measured:.0f} N",
                f"{axial:.0f} N ({_beyond(axial, measured)})",
                f"{radial / axial:.2f}; solid FE 0.23",
            ),
            (
                "cone of [Bharti2024], 11 mm deep, R_m not given",
                "381 +- 26 N",
                f"{other:.2f} N per MPa: R_m {355 / other:.0f} to {407 / other:.0f} MPa would fit",
                "",
            ),
        ),
    )


if __name__ == "__main__":
    PAGE.write()
