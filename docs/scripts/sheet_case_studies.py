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
from docs.scripts.runs import evaluated, example
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
        deep = case.part.coordinates(case.desired.tools[0])[:, 2] < -0.99e-3
        into_part = case.part.rotation.inv()
        forces = [
            abs(into_part.apply(tool.wrench[deep, :3])[:, 2].mean())
            for tool in evaluated(case.process, case.desired)[0].tools
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
    whole, piece = evaluated(replace(process, schedule=always), case.desired)
    full = time.process_time() - start
    assert piece is not None
    points = case.part.coordinates(case.desired)
    spacing = case.resolved["process"]["position_m"]
    rows = []
    for window, every in ((0.02, 8), (0.02, 4), (0.03, 5)):
        model = SheetModel(
            process.model.mesh, ALUMINIUM, replace(process.model.settings, window=window)
        )
        plan = schedule(points, spacing, every)
        start = time.process_time()
        found, other = evaluated(replace(process, model=model, schedule=plan), case.desired)
        seconds = time.process_time() - start
        assert other is not None
        error = np.linalg.norm((found.wrench - whole.wrench)[:, :3], axis=1) / whole.peak_force
        bend = other.point_fields[DEFLECTION] - piece.point_fields[DEFLECTION]
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
