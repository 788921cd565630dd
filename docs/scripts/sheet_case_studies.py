"""Studies of the sheet in the examples' cases, each a Markdown table of docs/sheet_fem.md."""

from __future__ import annotations

from time import perf_counter
from typing import Any

from coupling.case.case import Case
from coupling.process.sheet_fem import SheetFem
from coupling.sheet_fem.equilibrium import Equilibrium
from docs.scripts.page import table
from docs.scripts.runs import around_axis, example


def alone_table() -> str:
    """Return what one evaluation of the example takes, and its force, over the size of elements."""
    _evaluated(example("cone_fem", process={"element_m": 8e-3}))  # compiles
    rows = []
    for element in (2.5, 2.0, 4.0):
        seconds, positions, iterations, force = _evaluated(
            example("cone_fem", process={"element_m": 1e-3 * element})
        )
        each = f"{iterations / positions:.1f}"
        rows.append((f"{element} mm", f"{positions}", each, f"{seconds:.0f} s", f"{force:.0f} N"))
    return table(
        ("elements", "positions", "iterations each", "time", "F_z in the last contour"), rows
    )


def _evaluated(case: Case) -> tuple[float, int, int, float]:
    """Return time [s], positions, iterations in all, and the last contour's mean force [N]."""
    process = case.process
    assert isinstance(process, SheetFem)
    found, iterations = process.model.equilibrium, list[int]()

    def counted(*args: Any) -> Equilibrium:
        equilibrium = found(*args)
        iterations.append(equilibrium.iterations)
        return equilibrium

    process.model.equilibrium = counted  # type: ignore[assignment, method-assign]
    begin = perf_counter()
    wrench = process.evaluate(case.desired).wrench
    seconds = perf_counter() - begin
    part = case.task.part
    points = part.coordinates(case.desired.position[0])
    deep = points[:, 2] < points[:, 2].min() + 1e-7
    force = around_axis(points, part.rotation.inv().apply(wrench.force[0]))[deep, 0].mean()
    return seconds, len(iterations), sum(iterations), float(force)


def gap_table() -> str:
    """Return the mean force across the sheet in a contour of the cell over gap and elements."""
    rows = []
    for gap, element in ((0.8, 2.0), (0.9, 2.0), (1.0, 2.0), (1.0, 1.6), (1.2, 2.0), (2.0, 2.0)):
        case = example(
            "two_robots_fem",
            support={"gap_m": 1e-3 * gap},
            process={"element_m": 1e-3 * element},
            tool_path={"step_down_m": 0.0005, "depth_m": 0.001},
        )
        part = case.task.part
        deep = part.coordinates(case.desired.position[0])[:, 2] < -0.99e-3
        forces = [
            abs(part.rotation.inv().apply(force[deep])[:, 2].mean())
            for force in case.process.evaluate(case.desired).wrench.force
        ]
        rows.append((f"{gap} mm", f"{element} mm", *(f"{force:.0f}" for force in forces)))
    return table(("gap", "elements", "forming tool", "supporting tool"), rows)
