"""The frame of a page's experiments: cases are run, and their figures make a table or a picture.

A script of a page has this form; named on the command line, parts are made alone:

    PAGE = Page("inverse")

    @PAGE.part
    def cycles() -> str:
        columns = {"max [um]": lambda run: um(run.maximum)}
        return results(("cycle",), {"1 ms": 1e-3, "4 ms": 4e-3}, corrected, columns)

    if __name__ == "__main__":
        PAGE.write()
"""

from __future__ import annotations

import sys
import tempfile
from collections.abc import Callable, Iterable, Mapping
from dataclasses import dataclass, field
from functools import cache
from pathlib import Path
from typing import TypeVar

import numpy as np
import plotly.graph_objects as go

from docs.scripts.page import finish, replace_parts, table

Title = TypeVar("Title", bound=str | tuple[str, ...])
Case = TypeVar("Case")
Run = TypeVar("Run")


@dataclass(frozen=True)
class Page:
    """A page of docs/ with parts between marks.

    Attributes:
        name: Name of the page.
        parts: Functions that return the parts' texts, by the names of their marks.
    """

    name: str
    parts: dict[str, Callable[[], str]] = field(default_factory=dict)

    def part(self, make: Callable[[], str]) -> Callable[[], str]:
        """Register a function for the part of its name."""
        self.parts[make.__name__] = make
        return make

    def write(self) -> None:
        """Write the parts that the command line names, or all, and exit."""
        sys.exit(finish(lambda: replace_parts(self.name, self.parts, sys.argv[1:])))


def results(
    head: tuple[str, ...],
    cases: Mapping[Title, Case],
    run: Callable[[Case], Run],
    columns: Mapping[str, Callable[[Run], str]],
) -> str:
    """Run cases and return a table with a row for each; rows are printed as they are ready.

    Args:
        head: Heads of the columns of titles.
        cases: By title, or by a title for each of these columns.
        run: What is done with a case.
        columns: Cells of what this returns, by their heads; blanks at a head's end are left out.
    """
    rows = []
    for title, case in cases.items():
        done = run(case)
        titles = (title,) if isinstance(title, str) else title
        rows.append((*titles, *(cell(done) for cell in columns.values())))
        print(*rows[-1], sep="; ", flush=True)
    return table((*head, *(name.rstrip() for name in columns)), rows)


def um(length: float, digits: int) -> str:
    """Return a length [m] in micrometres, from a nanometre to a decimetre without an exponent."""
    return f"{float(f'{1e6 * length:.{digits}g}'):g}"


@cache
def _folder() -> tempfile.TemporaryDirectory[str]:
    return tempfile.TemporaryDirectory()


def scratch(name: str) -> Path:
    """Return the path of a file or folder that lasts as long as the program."""
    return Path(_folder().name, name)


@dataclass(frozen=True)
class Curve:
    """A line of a picture.

    Attributes:
        name: In the legend; empty: not there.
        x, y: Its points, (n,).
        color: Its colour.
        width: Its width [px].
        dash: Plotly's name of its dashes.
        shape: Plotly's name of how points are joined.
    """

    name: str
    x: np.ndarray
    y: np.ndarray
    color: str
    width: float = 1.5
    dash: str = "solid"
    shape: str = "linear"


def add_curves(figure: go.Figure, curves: Iterable[Curve], **trace: object) -> go.Figure:
    """Add lines to a figure, with further keys of their traces, such as row and col."""
    for curve in curves:
        line = {key: getattr(curve, key) for key in ("color", "width", "dash", "shape")}
        keys = {"showlegend": bool(curve.name), "mode": "lines", **trace}
        figure.add_scatter(x=curve.x, y=curve.y, name=curve.name, line=line, **keys)
    return figure
