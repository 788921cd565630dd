"""elastic-robot identify --plan: the table of what to measure next."""

from __future__ import annotations

import csv
import io
from pathlib import Path

from coupling.errors import IdentifyError
from coupling.files.atomic_file import write_atomically, writing
from coupling.files.output_file import require_output
from coupling.identification.static.measurements import FORCE, SHIFT
from coupling.identification.static.plan import MeasurementPlan


def require_replaceable_plan(file: Path) -> None:
    """Refuse a file that is no plan, a plan into which something was filled in, and another's page."""
    require_output(file, ".csv", IdentifyError)
    require_output(file.with_suffix(".html"), ".html", IdentifyError)
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
