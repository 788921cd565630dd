"""Write the tables and pictures of docs/sheet_fem.md anew: make sheet-fem.

With names, only those parts: python docs/scripts/make_sheet_fem.py gap example.  CalculiX runs
where it is installed.
"""

from __future__ import annotations

import sys

import numpy as np

from coupling.case.case import Case
from coupling.report import workpiece_figures
from coupling.run.execute import Run
from coupling.run.figures import Deviations
from docs.scripts import sheet_case_studies, sheet_cone_studies, sheet_studies
from docs.scripts.page import finish, replace_parts, table
from docs.scripts.pictures import save
from docs.scripts.runs import around_axis, compensated, example, gap_ranges, peak_force, workpieces


def cone() -> str:
    """Run the example, draw its sheet, and return what its section says of the run."""
    case = example("cone_fem")
    run = compensated(case)
    _draw(case, run)
    return _verdict(run) + "\n" + _contours(case, run)


def _verdict(run: Run) -> str:
    found, deviations = run.correction, Deviations.of(run)
    each = run.durations["compensate"] / found.evaluations
    before, after = 1e6 * deviations.before.maximum, 1e6 * deviations.after.maximum
    gravity, process = 1e6 * deviations.gravity.maximum, 1e6 * deviations.process.maximum
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
    cut, fields = workpiece_figures.cut(pieces), workpiece_figures.fields(pieces)
    cut.update_layout(width=500, height=420, showlegend=True)
    for figure in fields:
        figure.update_layout(width=450, height=420, updatemenus=())
    save("cone_fem", cut, *fields)


def cell() -> str:
    """Run the cell with a sheet between two tools, and return its figures."""
    case = example("two_robots_fem")
    run = compensated(case)
    rows = []
    for tool, name in enumerate(run.robots):
        own = Deviations.of(run, tool)
        figures = (f"{1e6 * own.before.maximum:.0f} um", f"{1e6 * own.after.maximum:.1f} um")
        rows.append((f"{name} tool", *figures, f"{peak_force(run, tool):.0f} N"))
    rows.append(("gap", *gap_ranges(run), ""))
    found = run.correction
    each = run.durations["compensate"] / found.evaluations
    return (
        table(("", "before, max", "after, max", "peak force"), rows)
        + f"\n\nVerdict: {found.reason}; {found.evaluations} evaluations, {each:.0f} s each including"
        " the robots' simulation."
    )


PARTS = {
    "shallow": sheet_studies.shallow_table,
    "thick": sheet_studies.thick_table,
    "cone": sheet_cone_studies.cone_table,
    "fineness": sheet_cone_studies.fineness_table,
    "friction": sheet_cone_studies.friction_table,
    "example": cone,
    "cell": cell,
    "gap": sheet_case_studies.gap_table,
}


if __name__ == "__main__":
    sys.exit(finish(lambda: replace_parts("sheet_fem", PARTS, sys.argv[1:])))
