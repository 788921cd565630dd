"""Work and precision on the ISO 9283 reference path: the native FMU, SciPy and MuJoCo.

    python benchmarks/iso_path.py                                  the whole path, about 6 minutes
    python benchmarks/iso_path.py --end 1                          a quick look
    python benchmarks/iso_path.py --page docs/performance.md       and write the page's tables

One run, one core.  Errors are those of the TCP against tests/reference, made with other engines.
"""

import os

for _library in ("OPENBLAS_NUM_THREADS", "OMP_NUM_THREADS", "MKL_NUM_THREADS"):
    os.environ[_library] = "1"

import argparse
from pathlib import Path

from rich.console import Console
from rich.table import Table

from benchmarks.goals import default, goals
from benchmarks.page import write_tables
from benchmarks.solvers import mujoco, native_fmu, scipy_solver
from benchmarks.task import CURVES, Entry, Row, Task

# Communication steps of the native FMU [s]: every second point of the reference first.
PERIODS = (2e-2, 1e-2, 4e-3)
# By torque curve and method.
Settings = dict[str, dict[str, tuple[float, ...]]]
# Relative tolerances: the loosest with which each stays within 1e-6 m, or nearest to it.
SCIPY: Settings = {
    "linear": {"DOP853": (1e-3,), "Radau": (1e-3,), "LSODA": (1e-4,)},
    "backlash": {"DOP853": (1e-4,), "Radau": (1e-4,), "LSODA": (1e-7,)},
}
# Steps [s]; RK4 is unstable above 1.06 ms (the fastest eigenvalue is 2600/s).
MUJOCO: Settings = {
    "linear": {"RK4": (1e-3, 2.5e-4), "implicitfast": (1e-3, 1.25e-4)},
    "backlash": {
        "RK4": (1e-3, 2.5e-4, 6.25e-5),
        "implicitfast": (1e-3, 1.25e-4, 1.5625e-5),
    },
}


def entries(task: Task) -> list[Entry]:
    """Return the solvers of a table."""
    return [
        *(native_fmu(task, period) for period in PERIODS),
        *(mujoco(task, name, step) for name, steps in MUJOCO[task.curve].items() for step in steps),
        *(
            scipy_solver(task, name, rtol)
            for name, rtols in SCIPY[task.curve].items()
            for rtol in rtols
        ),
    ]


def main() -> None:
    """Print the tables and what they say of the goals."""
    parser = argparse.ArgumentParser(description="Work and precision on the ISO 9283 path.")
    parser.add_argument("--end", type=float, default=22.8, help="stop here [s]; a multiple of 0.02")
    parser.add_argument("--page", type=Path, help="write the tables into this page")
    options = parser.parse_args()
    console = Console()
    tables: dict[str, list[Row]] = {}
    for curve in CURVES:
        task = Task.load(curve, options.end)
        tables[curve] = []
        for entry in entries(task):
            with console.status(f"{curve}: {entry.name}"):
                tables[curve].append(Row.of(entry, task))
        console.print(_table(curve, tables[curve]))
    for goal in goals(tables):
        console.print(str(goal))
    if options.page is not None:
        write_tables(options.page, tables, options.end)
        console.print(f"{options.page}: tables written")


def _table(curve: str, rows: list[Row]) -> Table:
    table = Table("solver", "time [s]", "TCP error [m]", "up to 9 s [m]", "ratio", title=curve)
    base = default(rows).spent
    for row in rows:
        ratio = f"{row.spent / base:.2f}"
        table.add_row(row.name, f"{row.spent:.3f}", f"{row.whole:.1e}", f"{row.early:.1e}", ratio)
    return table


if __name__ == "__main__":
    main()
