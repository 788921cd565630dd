"""Write the tables and the picture of docs/robin.md: make robin.

With names, only those parts: python docs/scripts/make_robin.py predictions.
"""

from __future__ import annotations

import sys
from collections.abc import Callable, Sequence
from functools import cache

import plotly.graph_objects as go

from benchmarks import evaluations
from benchmarks.evaluation_tasks import TASKS
from benchmarks.evaluations import STATED, WITHHELD, CouplingRow
from docs.scripts.page import finish, replace_parts, table
from docs.scripts.pictures import save, styled

# Tasks of the picture, and the distance below which its lines end [um].
PICTURED = (
    ("robot, wall, gain 5", "The robot on a wall, loop gain 5"),
    ("robot on a wall, cone", "A cone, gears unloaded in their backlash"),
)
LEAST = 1e-3
COLOURS = {
    STATED: "#0072b2",
    WITHHELD: "#56b4e9",
    "constant": "#999999",
    "aitken": "#e69f00",
    "anderson": "#d55e00",
}


@cache
def _rows() -> tuple[CouplingRow, ...]:
    """Return the rows of all tasks that do not take long."""
    found = []
    for row in evaluations.rows(TASKS):
        found.append(row)
        print(*evaluations.cells(row), sep="; ", flush=True)
    return tuple(found)


def _drawn(rows: Sequence[CouplingRow], task: str, title: str) -> go.Figure:
    """Return how far every scheme is from the solution, over its evaluations."""
    figure = go.Figure()
    for row in rows:
        if (row.task, row.mode) == (task, "quasistatic"):
            off = [max(1e6 * error, LEAST) for error in row.errors]
            figure.add_scatter(
                x=list(range(1, len(off) + 1)),
                y=off,
                name=row.scheme,
                mode="lines+markers",
                line={"color": COLOURS[row.scheme], "width": 2},
                marker={"size": 7},
            )
    figure.add_hline(y=1e6 * evaluations.ENOUGH, line={"dash": "dot", "color": "black"})
    figure.update_xaxes(title="evaluations of the process", range=[0.5, 20.5])
    figure.update_yaxes(
        title="distance from the solution [um]",
        type="log",
        exponentformat="power",
        dtick=1,
        range=[-3.3, 4.4],
    )
    styled(figure, 560, 460)
    figure.update_layout(
        title={"text": title, "x": 0.5, "y": 0.97, "yanchor": "top"},
        margin={"t": 130, "b": 50},
        legend={"y": 1.04, "yanchor": "bottom"},
    )
    return figure


def convergence() -> str:
    """Draw the convergence with springs and without."""
    pictures = [_drawn(_rows(), task, title) for task, title in PICTURED]
    save("robin_convergence", *pictures)
    return "![Distance from the solution over the evaluations](figures/robin_convergence.png)"


def predictions() -> str:
    """Return the evaluations that every scheme takes, over all tasks."""
    by_scheme: dict[str, list[CouplingRow]] = {}
    for row in _rows():
        by_scheme.setdefault(row.scheme, []).append(row)
    lines = []
    for scheme, rows in by_scheme.items():
        counts = [row.evaluations for row in rows if row.converged]
        lines.append((scheme, f"{min(counts)} to {max(counts)}", f"{len(rows) - len(counts)}"))
    tasks = len(next(iter(by_scheme.values())))
    return table(("scheme", "evaluations", f"not converged, of {tasks}"), lines)


PARTS: dict[str, Callable[[], str]] = {
    "convergence": convergence,
    "predictions": predictions,
}


if __name__ == "__main__":
    sys.exit(finish(lambda: replace_parts("robin", PARTS, sys.argv[1:])))
