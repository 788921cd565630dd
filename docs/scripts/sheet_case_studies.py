"""Studies of the sheet in the examples' cases, each a Markdown table of docs/sheet_fem.md."""

from __future__ import annotations

from docs.scripts.page import table
from docs.scripts.runs import example


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
