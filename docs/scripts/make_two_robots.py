"""Write the result and figures of docs/two_robots.md from a run of that case: make two-robots."""

from __future__ import annotations

import numpy as np
import plotly.graph_objects as go

from coupling.case.case import Case
from coupling.report.colours import AFTER, BEFORE, DESIRED
from coupling.run.execute import Run
from coupling.run.figures import shares_of
from coupling.run.path_checks import TOOL_GAP
from docs.scripts.experiment import Curve, Page, add_curves
from docs.scripts.page import table
from docs.scripts.pictures import save, styled
from docs.scripts.runs import compensated, example, gap_ranges, tool_rows

PAGE = Page("two_robots")
_UM, _MM = 1e6, 1e3
# Deviations below this are not told apart in the figure [um].
_FLOOR = 1e-2
# Samples on the axis of the figure, up to rounding [m].
_NEAR = 1e-9


def tools(case: Case) -> go.Figure:
    """Draw both spheres where contours begin, in the plane of the part's x and z axes."""
    forming, supporting = (case.task.part.coordinates(p) for p in case.desired.position)
    diameter = case.resolved["support"]["tool_diameter_m"]  # the same of both tools in this case
    figure = go.Figure()
    angle = np.linspace(0.0, 2.0 * np.pi, 100)
    circle = 0.5 * diameter * np.column_stack([np.cos(angle), np.sin(angle)])
    step = case.resolved["tool_path"]["step_down_m"]
    starts = np.abs(forming[:, 1]) < _NEAR
    contours = [k * step for k in range(0, round(-forming[:, 2].min() / step) + 1, 2)]
    for number, depth in enumerate(contours):
        at = int(np.argmax(starts & (np.abs(forming[:, 2] + depth) < _NEAR)))
        for points, side, name, color in (
            (forming, 1.0, "forming tool", AFTER),
            (supporting, -1.0, "supporting tool", BEFORE),
        ):
            x, z = _MM * (points[at, [0, 2]] + np.array([0.0, side * 0.5 * diameter]) + circle).T
            circle_curve = Curve(name if number == 0 else "", x, z, color)
            add_curves(figure, [circle_curve], opacity=0.35 + 0.65 * number / len(contours))
    figure.update_xaxes(title="x of the part [mm]")
    figure.update_yaxes(title="z [mm]", scaleanchor="x")
    return styled(figure, 700, 480)


def gap(run: Run) -> go.Figure:
    """Draw the gap over time, before and after."""
    gap = run.finding_of(TOOL_GAP)
    assert gap is not None
    time, commanded = gap.time, gap.commanded
    openings = (("before", gap.before, BEFORE), ("after", gap.after, AFTER))
    curves = [
        Curve(name, time, _MM * (commanded + opening), color) for name, opening, color in openings
    ]
    figure = add_curves(go.Figure(), curves)
    figure.add_hline(y=_MM * commanded, line={"color": DESIRED, "dash": "dash", "width": 1})
    figure.update_yaxes(title="gap [mm]", rangemode="tozero")
    figure.update_xaxes(title="time [s]")
    return styled(figure, 520, 420)


def deviations(run: Run) -> go.Figure:
    """Draw the distance of each tool from its path, before and after."""
    curves = []
    for tool, (name, dash) in enumerate(zip(run.robots, ("solid", "dot"), strict=True)):
        states = (("before", run.before, BEFORE), ("after", run.correction.achieved, AFTER))
        for state, path, color in states:
            apart = path.tools[tool].distance_to(run.desired.tools[tool])
            distance = np.maximum(_UM * apart, _FLOOR)
            curves.append(Curve(f"{name}, {state}", path.time, distance, color, dash=dash))
    figure = add_curves(go.Figure(), curves)
    figure.update_yaxes(title="deviation [um]", type="log")
    figure.update_xaxes(title="time [s]")
    return styled(figure, 520, 420)


@PAGE.part
def result() -> str:
    """Run the case, draw it, and return deviations of both robots and the gap."""
    case = example("two_robots")
    run = compensated(case)
    save("two_robots_tools", tools(case))
    save("two_robots_gap", gap(run), deviations(run))
    opening = run.finding_of(TOOL_GAP)
    assert opening is not None
    gap_row = (f"gap, commanded {_MM * opening.commanded:.3f} mm", *gap_ranges(run), "")
    compared = table(("", "before, max", "after, max", "peak force"), [*tool_rows(run), gap_row])
    done = run.correction
    return (
        f"{compared}\n\nVerdict: {done.reason}, {done.evaluations} evaluations of the process. Before"
        f" compensation both robots sag, {_UM * shares_of(run).gravity.maximum:.0f} um at most due to"
        " gravity."
    )


if __name__ == "__main__":
    PAGE.write()
