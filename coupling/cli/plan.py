"""elastic-robot identify --plan: the table of what to measure next, and what to expect of it."""

from __future__ import annotations

import csv
import io
from pathlib import Path

import numpy as np

from coupling.cli.console import console
from coupling.errors import IdentifyError
from coupling.files.atomic_file import write_atomically, writing
from coupling.files.output_file import require_output
from coupling.identification.static.measurements import FORCE, SHIFT
from coupling.identification.static.plan import MeasurementPlan
from coupling.report.terminal import print_sections
from coupling.results.section import Section, Table


def require_replaceable_plan(file: Path) -> None:
    """Refuse a file that is no plan, and a plan into which something was filled in."""
    require_output(file, ".csv", IdentifyError)
    if not file.is_file():
        return
    with writing(file, IdentifyError):
        rows = file.read_text(encoding="utf-8", errors="replace").splitlines()[2:]
    if not all(row.endswith("," * len(SHIFT)) for row in rows):
        raise IdentifyError(
            f"{file}: holds a plan with measurements: give another name for the new one (--output)"
        )


def write_plan(plan: MeasurementPlan, file: Path) -> None:
    """Write the poses and loads of a plan, with empty cells for what will be measured."""
    planned = plan.measurements
    angles = tuple(f"q{i + 1}" for i in range(planned.q.shape[1]))
    stream = io.StringIO()
    rows = csv.writer(stream, lineterminator="\n")
    stream.write(
        "# Poses and loads to measure, by elastic-robot identify: fill in dx, dy, dz [m], base axes,"
        " loaded less unloaded.\n"
    )
    rows.writerow(("name", *angles, *FORCE, *SHIFT))
    for k in range(planned.count):
        numbers = [*planned.q[k], *planned.wrench[k, :3]]
        rows.writerow([f"pose {k + 1}", *(f"{value:.9g}" for value in numbers), "", "", ""])
    write_atomically(file, stream.getvalue(), IdentifyError)


def print_plan(plan: MeasurementPlan, file: Path) -> None:
    """Print the confidence intervals that the planned measurements are expected to give."""
    rows = [
        (
            expectation.name,
            f"{expectation.start:.4g}",
            _percent(expectation.before),
            _percent(expectation.after),
        )
        for expectation in plan.expected
    ]
    away = np.linalg.norm(plan.measurements.deflection, axis=1)
    parts = (
        "Expected 95 % interval of each compliance relative to its value (+- %), if the start file"
        " is right:",
        Table(("parameter", "start", "so far", "then"), rows),
        f"Expected deflections: {1e3 * away.min():.3g} to {1e3 * away.max():.3g} mm. Check every pose"
        " for collisions before you move the robot there.",
        f"{file}: {plan.measurements.count} poses and loads",
    )
    print_sections(console, [Section("", parts)])


def _percent(half: float) -> str:
    return "unknown" if not np.isfinite(half) else f"{100.0 * half:.3g} %"
