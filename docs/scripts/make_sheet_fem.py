"""Write the tables and pictures of docs/sheet_fem.md anew: make sheet-fem.

With names, only those parts: python docs/make_sheet_fem.py window example.  CalculiX runs where it is
installed.
"""

from __future__ import annotations

import sys
from pathlib import Path

import numpy as np

from coupling.case import Case, load_case
from coupling.report import workpiece_figures
from coupling.run.folder import runs_of_robots
from coupling.run.study import Run, run_compensation
from docs.scripts import sheet_case_studies, sheet_cone_studies, sheet_studies
from docs.scripts.screenshot import NoBrowserError, save_side_by_side
from docs.scripts.sheet_studies import header, row

DOCS = Path(__file__).parents[1]
PAGE = DOCS / "sheet_fem.md"
PICTURE = DOCS / "figures" / "cone_fem.png"


def example() -> str:
    """Run the example, draw its sheet, and return what its section says of the run."""
    case = load_case(sheet_case_studies.EXAMPLE)
    run = run_compensation(case)
    _draw(run)
    return _verdict(run) + "\n" + _contours(case, run)


def _verdict(run: Run) -> str:
    each = run.durations["compensate"] / run.process_evaluations
    before, after = 1e6 * run.before.maximum, 1e6 * run.after.maximum
    gravity, process = 1e6 * run.shares.gravity.maximum, 1e6 * run.shares.process.maximum
    return (
        f"Verdict: {run.reason}; {run.process_evaluations} evaluations of the process, {each:.0f} s"
        f" each on average.\nDeviation at most {before:.0f} um before (gravity {gravity:.0f} um, the"
        f" process {process:.0f} um)\nand {after:.1f} um after, the process evaluated on the path really"
        f" taken. Peak force {run.wrench.peak_force:.0f} N.\n"
    )


def _contours(case: Case, run: Run) -> str:
    """Return the mean force in every contour, after compensation."""
    points = case.part.coordinates(case.desired)
    force = case.part.rotation.inv().apply(run.wrench.wrench[:, :3])
    outward = points * [1.0, 1.0, 0.0]
    outward /= np.linalg.norm(outward, axis=1, keepdims=True)
    ahead = np.cross([0.0, 0.0, 1.0], outward)
    depths = np.unique(points[:, 2].round(6))
    depths = depths[depths < 0.0][::-1]
    within = [flat for depth in depths if np.sum(flat := np.abs(points[:, 2] - depth) < 1e-7) > 20]
    deep = [-1e3 * points[flat, 2].mean() for flat in within]
    components = {
        "F_z": force[:, 2],
        "F_r": -np.sum(force * outward, axis=1),
        "F_t": -np.sum(force * ahead, axis=1),
    }
    return header("depth", *[f"{depth:.0f} mm" for depth in deep]) + "".join(
        row(name, [values[flat].mean() for flat in within]) for name, values in components.items()
    )


def _draw(run: Run) -> None:
    """Draw the formed sheet before and after compensation."""
    assert run.workpiece_before is not None
    assert run.wrench.workpiece is not None
    pieces = {"before": run.workpiece_before, "after": run.wrench.workpiece}
    cut, fields = workpiece_figures.cut(pieces), workpiece_figures.fields(pieces)
    cut.update_layout(width=500, height=420)
    fields.update_layout(width=900, height=420)
    fields.layout.updatemenus = ()
    save_side_by_side([cut, fields], PICTURE)


def cell() -> str:
    """Run the cell with a sheet between two tools, and return its figures."""
    case = load_case(sheet_case_studies.CELL)
    run = run_compensation(case)
    text = header("", "before, max", "after, max", "peak force")
    for name, own in runs_of_robots(case, run).items():
        text += (
            f"| {name} tool | {1e6 * own.before.maximum:.0f} um | {1e6 * own.after.maximum:.1f} um"
        )
        text += f" | {own.wrench.peak_force:.0f} N |\n"
    assert run.gap is not None
    gap = {name: 1e3 * value for name, value in run.gap.as_dict().items()}
    text += f"| gap | {gap['narrowest_before']:.3f} to {gap['widest_before']:.3f} mm"
    text += f" | {gap['narrowest_after']:.3f} to {gap['widest_after']:.3f} mm | |\n"
    each = run.durations["compensate"] / run.process_evaluations
    return f"{text}\nVerdict: {run.reason}; {run.process_evaluations} evaluations, {each:.0f} s each.\n"


PARTS = {
    "shallow": sheet_studies.shallow_table,
    "deep": sheet_studies.deep_table,
    "cone": sheet_cone_studies.cone_table,
    "radial": sheet_cone_studies.radial_table,
    "fineness": sheet_cone_studies.fineness_table,
    "friction": sheet_cone_studies.friction_table,
    "window": sheet_case_studies.window_table,
    "example": example,
    "cell": cell,
    "gap": sheet_case_studies.gap_table,
}


def main(names: list[str]) -> int:
    """Fill parts of the page, each between its two marks; return the exit status."""
    for name in names or list(PARTS):
        print(name, flush=True)
        try:
            text = PARTS[name]()
        except NoBrowserError as error:
            print(f"error: {error}", file=sys.stderr)
            return 2
        page = PAGE.read_text(encoding="utf-8")
        before, begin, rest = page.partition(f"<!-- {name} -->\n")
        _, end, after = rest.partition(f"<!-- end of {name} -->")
        assert end, f"{PAGE}: needed is a pair of marks of {name!r}"
        PAGE.write_text(before + begin + text + end + after, encoding="utf-8")
    return 0


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
