"""Write the table of docs/robin.md: make robin."""

from __future__ import annotations

from benchmarks import evaluations
from benchmarks.evaluation_tasks import TASKS
from benchmarks.evaluations import CouplingRow
from docs.scripts.experiment import Page
from docs.scripts.page import table

PAGE = Page("robin")


@PAGE.part
def predictions() -> str:
    """Return the evaluations that every scheme takes, over all tasks that do not take long."""
    by_scheme: dict[str, list[CouplingRow]] = {}
    for row in evaluations.rows(TASKS):
        print(*evaluations.cells(row), sep="; ", flush=True)
        by_scheme.setdefault(row.scheme, []).append(row)
    lines = []
    for scheme, rows in by_scheme.items():
        counts = [row.evaluations for row in rows if row.converged]
        lines.append((scheme, f"{min(counts)} to {max(counts)}", f"{len(rows) - len(counts)}"))
    tasks = len(next(iter(by_scheme.values())))
    return table(("scheme", "evaluations", f"not converged, of {tasks}"), lines)


if __name__ == "__main__":
    PAGE.write()
