"""Write the tables and pictures of docs/sheet_fem.md anew: make sheet-fem.

CalculiX runs where it is installed.
"""

from __future__ import annotations

from operator import itemgetter

import numpy as np
import plotly.graph_objects as go

from coupling.case.case import Case
from coupling.path.workpiece import Workpiece
from coupling.report import workpiece_figures
from coupling.run.execute import Run
from coupling.run.figures import shares_of
from docs.scripts import runs, sheet_studies
from docs.scripts.experiment import Page, results
from docs.scripts.page import table
from docs.scripts.pictures import save
from docs.scripts.runs import around_axis, compensated, gap_ranges, tool_rows, workpieces

PAGE = Page("sheet_fem")


@PAGE.part
def example() -> str:
    """Run the example, draw its sheet, and return what its section says of the run."""
    case = runs.example("cone_fem")
    run = compensated(case)
    _draw(case, run)
    return _verdict(run) + "\n" + _contours(case, run)


def _verdict(run: Run) -> str:
    found, shares = run.correction, shares_of(run)
    each = run.durations["compensate"] / found.evaluations
    before, after = (1e6 * run.deviation(path).maximum for path in (run.before, found.achieved))
    gravity, process = 1e6 * shares.gravity.maximum, 1e6 * shares.process.maximum
    return (
        f"Verdict: {found.reason}; {found.evaluations} evaluations of the process, {each:.0f} s"
        " each including the robot's simulation.\n"
        f"Deviation at most {before:.0f} um before (gravity {gravity:.0f} um, the"
        f" process {process:.0f} um)\nand {after:.1f} um after, with the process evaluated on the actual"
        f" path. Peak force {found.response.wrench.peak_force:.0f} N.\n"
    )


def _contours(case: Case, run: Run) -> str:
    """Return the mean force in every contour, after compensation."""
    part = case.task.part
    points = part.coordinates(run.desired.position[0])
    force = part.rotation.inv().apply(run.correction.response.wrench.force[0])
    depths = np.unique(points[:, 2].round(6))
    depths = depths[depths < 0.0][::-1]
    within = [flat for depth in depths if np.sum(flat := np.abs(points[:, 2] - depth) < 1e-7) > 100]
    deep = [-1e3 * points[flat, 2].mean() for flat in within]
    components = zip(("F_z", "F_r", "F_t"), around_axis(points, force).T, strict=True)
    return table(
        ("depth", *(f"{depth:.0f} mm" for depth in deep)),
        ((name, *(f"{values[flat].mean():.0f}" for flat in within)) for name, values in components),
    )


def _draw(case: Case, run: Run) -> None:
    """Draw the formed sheet before and after compensation."""
    pieces = workpieces(case, run)
    cut = workpiece_figures.cut(pieces)
    cut.update_layout(width=500, height=420, showlegend=True)
    save("cone_fem", cut, *(_shape(name, piece) for name, piece in pieces.items()))


def _shape(name: str, piece: Workpiece) -> go.Figure:
    """Draw a formed sheet, coloured by its first field."""
    surface = workpiece_figures.workpiece_surface(name, piece)
    x, y, z = 1e3 * surface.points.T
    label, values = next(iter(surface.fields.items()))
    i, j, k = surface.triangles.T
    colours = {"intensity": values, "colorbar": {"title": label}, "colorscale": "Viridis"}
    if len(values) == len(surface.triangles):
        colours["intensitymode"] = "cell"
    figure = go.Figure(go.Mesh3d(x=x, y=y, z=z, i=i, j=j, k=k, **colours))
    return figure.update_layout(width=450, height=420, title=name)


@PAGE.part
def cell() -> str:
    """Run the cell with a sheet between two tools, and return its figures."""
    case = runs.example("two_robots_fem")
    run = compensated(case)
    found = run.correction
    each = run.durations["compensate"] / found.evaluations
    return (
        table(
            ("", "before, max", "after, max", "peak force"),
            [*tool_rows(run), ("gap", *gap_ranges(run), "")],
        )
        + f"\n\nVerdict: {found.reason}; {found.evaluations} evaluations, {each:.0f} s each including"
        " the robots' simulation."
    )


@PAGE.part
def gap() -> str:
    """Return the mean force across the sheet in a contour of the cell over gap and elements."""

    def forces(cell: tuple[float, float]) -> list[str]:
        case = runs.example(
            "two_robots_fem",
            support={"gap_m": 1e-3 * cell[0]},
            process={"element_m": 1e-3 * cell[1]},
            tool_path={"step_down_m": 0.0005, "depth_m": 0.001},
        )
        part = case.task.part
        deep = part.coordinates(case.desired.position[0])[:, 2] < -0.99e-3
        wrench = case.process.evaluate(case.desired).wrench
        across = (part.rotation.inv().apply(force[deep])[:, 2] for force in wrench.force)
        return [f"{abs(force.mean()):.0f}" for force in across]

    cells = ((0.8, 2.0), (0.9, 2.0), (1.0, 2.0), (1.0, 1.6), (1.2, 2.0), (2.0, 2.0))
    return results(
        ("gap", "elements"),
        {tuple(f"{length} mm" for length in cell): cell for cell in cells},
        forces,
        {"forming tool": itemgetter(0), "supporting tool": itemgetter(1)},
    )


for study in (sheet_studies.shallow, sheet_studies.thick, sheet_studies.fineness):
    PAGE.part(study)


if __name__ == "__main__":
    PAGE.write()
