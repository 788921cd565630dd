"""Studies of the sheet in the examples' cases, each a Markdown table of docs/sheet_fem.md."""

from __future__ import annotations

import time
from dataclasses import replace

import numpy as np

from coupling.process.sheet_fem import SheetFem
from coupling.sheet_fem.forming import SheetModel
from coupling.sheet_fem.schedule import schedule
from coupling.sheet_fem.shape import DEFLECTION
from docs.scripts.page import table
from docs.scripts.runs import example
from docs.scripts.sheet_studies import ALUMINIUM


def gap_table() -> str:
    """Return the mean force across the sheet in a contour of the cell over gap and elements."""
    rows = []
    for gap, element in ((1.0, 4.0), (1.0, 2.5), (1.0, 2.0), (1.1, 2.5), (1.2, 2.5), (2.0, 2.5)):
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


def window_table() -> str:
    """Return what the example's window changes in two contours, against the whole sheet always."""
    case = example("cone_fem", tool_path={"depth_m": 0.002})
    process = case.process
    assert isinstance(process, SheetFem)
    always = replace(
        process.schedule, everywhere=np.ones_like(process.schedule.everywhere, dtype=bool)
    )
    start = time.process_time()
    whole = replace(process, schedule=always).evaluate(case.desired)
    full = time.process_time() - start
    assert whole.workpiece is not None
    shape = whole.workpiece.point_fields[DEFLECTION]
    points = case.task.part.coordinates(case.desired.position[0])
    spacing = case.resolved["process"]["position_m"]
    rows = []
    for window, every in ((0.02, 8), (0.02, 4), (0.03, 5)):
        model = SheetModel(
            process.model.mesh, ALUMINIUM, replace(process.model.settings, window=window)
        )
        plan = schedule(points, spacing, every)
        start = time.process_time()
        found = replace(process, model=model, schedule=plan).evaluate(case.desired)
        seconds = time.process_time() - start
        assert found.workpiece is not None
        off = found.wrench.force[0] - whole.wrench.force[0]
        error = np.linalg.norm(off, axis=1) / whole.wrench.peak_force
        bend = found.workpiece.point_fields[DEFLECTION] - shape
        rows.append(
            (
                f"{1e3 * window:.0f} mm, every {every}th",
                f"{100 * np.sqrt(np.mean(error**2)):.1f} %",
                f"{100 * error.max():.1f} %",
                f"{1e6 * np.sqrt(np.mean(bend**2)):.0f} um",
                f"{1e6 * np.abs(bend).max():.0f} um",
                f"{seconds:.0f}",
            )
        )
    rows.append(("whole sheet always", "0", "0", "0", "0", f"{full:.0f}"))
    head = ("window, whole sheet", "force, rms", "force, max", "shape, rms", "shape, max", "CPU s")
    return table(head, rows)
