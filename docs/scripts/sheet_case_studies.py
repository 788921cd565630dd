"""Studies of the sheet in the examples' cases, each a Markdown table of docs/sheet_fem.md."""

from __future__ import annotations

import tempfile
import time
from dataclasses import replace
from pathlib import Path

import numpy as np

from coupling.case import Case, load_case
from coupling.process.sheet_fem import SheetFem
from coupling.sheet_fem.forming import SheetModel
from coupling.sheet_fem.schedule import schedule
from coupling.sheet_fem.shape import DEFLECTION
from docs.scripts.sheet_studies import ALUMINIUM, header, row

CASES = Path(__file__).parents[2] / "examples" / "cases"
EXAMPLE, CELL = CASES / "cone_fem.toml", CASES / "two_robots_fem.toml"


def _changed(file: Path, *changes: tuple[str, str]) -> Case:
    """Return an example with other values."""
    text = file.read_text(encoding="utf-8")
    for old, new in changes:
        assert old in text, f"{file}: {old!r} is not there"
        text = text.replace(old, new)
    with tempfile.TemporaryDirectory() as folder:
        changed = Path(folder) / "changed.toml"
        changed.write_text(text, encoding="utf-8")
        return load_case(changed)


def gap_table() -> str:
    """Return the mean force across the sheet in a contour of the cell over gap and elements."""
    text = header("gap", "elements", "forming tool", "supporting tool")
    for gap, element in ((1.0, 4.0), (1.0, 2.5), (1.0, 2.0), (1.1, 2.5), (1.2, 2.5), (2.0, 2.5)):
        case = _changed(
            CELL,
            ("gap_m           = 0.002", f"gap_m = {1e-3 * gap}"),
            ("element_m          = 0.004", f"element_m = {1e-3 * element}"),
            ("step_down_m    = 0.001", "step_down_m = 0.0005"),
            ("depth_m        = 0.002", "depth_m = 0.001"),
        )
        deep = case.part.coordinates(case.desired.tools[0])[:, 2] < -0.99e-3
        into_part = case.part.rotation.inv()
        forces = [
            abs(into_part.apply(tool.wrench[deep, :3])[:, 2].mean())
            for tool in case.process.wrench(case.desired).tools
        ]
        text += row(f"{gap} mm | {element} mm", forces)
    return text


def window_table() -> str:
    """Return what the example's window changes in two contours, against the whole sheet always."""
    case = _changed(EXAMPLE, ("depth_m        = 0.005", "depth_m        = 0.002"))
    process = case.process
    assert isinstance(process, SheetFem)
    always = replace(
        process.schedule, everywhere=np.ones_like(process.schedule.everywhere, dtype=bool)
    )
    start = time.process_time()
    whole = replace(process, schedule=always).wrench(case.desired)
    full = time.process_time() - start
    peak = whole.peak_force
    assert whole.workpiece is not None
    shape = whole.workpiece.point_fields[DEFLECTION]
    text = header(
        "window, whole sheet", "force, rms", "force, max", "shape, rms", "shape, max", "CPU s"
    )
    points = case.part.coordinates(case.desired)
    spacing = case.resolved["process"]["position_m"]
    for window, every in ((0.02, 8), (0.02, 4), (0.03, 5)):
        model = SheetModel(
            process.model.mesh, ALUMINIUM, replace(process.model.settings, window=window)
        )
        plan = schedule(points, spacing, every)
        start = time.process_time()
        found = replace(process, model=model, schedule=plan).wrench(case.desired)
        seconds = time.process_time() - start
        error = np.linalg.norm((found.wrench - whole.wrench)[:, :3], axis=1) / peak
        assert found.workpiece is not None
        bend = found.workpiece.point_fields[DEFLECTION] - shape
        text += (
            f"| {1e3 * window:.0f} mm, every {every}th | {100 * np.sqrt(np.mean(error**2)):.1f} %"
        )
        text += f" | {100 * error.max():.1f} % | {1e6 * np.sqrt(np.mean(bend**2)):.0f} um"
        text += f" | {1e6 * np.abs(bend).max():.0f} um | {seconds:.0f} |\n"
    return text + f"| whole sheet always | 0 | 0 | 0 | 0 | {full:.0f} |\n"
