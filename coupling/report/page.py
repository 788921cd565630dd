"""The HTML page around the figures."""

from __future__ import annotations

import html
from collections.abc import Mapping
from pathlib import Path
from types import MappingProxyType
from typing import Any

import plotly.graph_objects as go
from plotly.io import to_html
from plotly.offline import get_plotlyjs

from coupling.errors import ResultError
from coupling.path.workpiece import Workpiece
from coupling.report import figures, tables, workpiece_figures
from coupling.report.thinning import PARTS
from coupling.run.stored_run import RESULT, StoredRobot, StoredRun, read_run, stages

_STYLE = """
body { font-family: system-ui, sans-serif; max-width: 1000px; margin: 2em auto; padding: 0 1em;
       color: #222; line-height: 1.45; }
h1 { font-size: 1.6em; margin-bottom: 0.2em; } h2 { font-size: 1.2em; margin-top: 2em; }
table { border-collapse: collapse; } td, th { padding: 0.25em 1em 0.25em 0; text-align: right; }
td:first-child, th:first-child { text-align: left; } th { border-bottom: 1px solid #999; }
.verdict { padding: 0.6em 1em; border-left: 6px solid; background: #f6f6f6; }
.yes { border-color: #009E73; } .no { border-color: #D55E00; }
"""


def write_report(folder: Path, file: Path | None = None) -> Path:
    """Write the report of a run folder; in that of a cell, also those of its robots.

    Args:
        folder: The run.
        file: File to write; report.html in the folder unless given.

    Returns:
        The file.

    Raises:
        ResultError: If the run cannot be read or the report not written.
    """
    target, run = file or folder / "report.html", read_run(folder)
    try:
        pages = _pages(folder, target, run)
    except (KeyError, TypeError, ValueError, AttributeError) as cause:
        raise ResultError(
            f"{folder / RESULT}: expected the figures of a run, got damaged ones:"
            f" {type(cause).__name__}: {cause}"
        ) from cause
    for place, page in pages.items():
        try:
            place.write_text(page, encoding="utf-8")
        except OSError as cause:
            raise ResultError(f"{place}: cannot be written: {cause.strerror or cause}") from cause
    return target


def _pages(folder: Path, target: Path, run: StoredRun) -> dict[Path, str]:
    """Return the pages of a run by their files."""
    if run.gap is None:
        return {target: robot_page(run.first, run.workpieces)}
    pages = {folder / name / "report.html": robot_page(own) for name, own in run.robots.items()}
    return {**pages, target: cell_page(run)}


def robot_page(
    robot: StoredRobot, workpieces: Mapping[str, Workpiece] = MappingProxyType({})
) -> str:
    """Return the page of one robot and its tool as one self-contained HTML text."""
    factor = figures.amplification(robot)
    sections = [
        ("Path", "path", figures.paths(robot, factor), _path_text(factor)),
        ("Convergence", "convergence", figures.convergence(robot), _CONVERGENCE_TEXT),
        ("Deviation along the path", "deviation", figures.deviation(robot), _deviation_text(robot)),
        ("Wrench along the path", "wrench", figures.wrench(robot), _wrench_text(robot)),
    ]
    changes = robot.figures["flank_changes"]
    if changes:
        text = _FLANKS_TEXT + tables.gears(changes)
        sections.insert(3, ("Gears in their play", "flanks", figures.flanks(robot), text))
    sections += _of_workpieces(workpieces)
    head = (tables.deviations, tables.plant, tables.robustness, tables.gear_loads, tables.drives)
    return _page(robot.figures, "".join(part(robot.figures) for part in head), sections)


def _of_workpieces(workpieces: Mapping[str, Workpiece]) -> list[tuple[str, str, go.Figure, str]]:
    """Return the sections of what a process leaves, none where it leaves nothing."""
    if not workpieces:
        return []
    return [
        ("Workpiece, cut", "cut", workpiece_figures.cut(workpieces), _CUT_TEXT),
        ("Workpiece", "workpiece", workpiece_figures.fields(workpieces), _WORKPIECE_TEXT),
    ]


def cell_page(cell: StoredRun) -> str:
    """Return the page of a cell, which leads to those of its robots."""
    rows = [
        (
            f'<a href="{name}/report.html">{name}</a>',
            *(f"{1e6 * value:.2f}" for value in _deviations(run.figures).values()),
            f"{run.figures['peak_force_N']:.1f}",
        )
        for name, run in cell.robots.items()
    ]
    header = ("deviation, max [um]", *stages(cell.figures), "peak force [N]")
    table = (
        f"{tables.table(header, rows)}"
        f"<p>{cell.figures['process_evaluations']} evaluations of the process.</p>"
        f"{tables.plant(cell.figures)}{tables.robustness(cell.figures)}"
    )
    sections = [
        ("Gap between the tools", "gap", figures.gap(cell), _GAP_TEXT),
        ("Tools in the cell", "path", figures.cell(cell), _CELL_TEXT),
        ("Convergence", "convergence", figures.convergence(cell.first), _CONVERGENCE_TEXT),
        *_of_workpieces(cell.workpieces),
    ]
    return _page(cell.figures, table, sections)


def _deviations(figures_: dict[str, Any]) -> dict[str, float]:
    """Return the largest deviations [m] by `stages`."""
    values = (figures_[f"deviation_{name}_m"]["maximum"] for name in ("before", "after"))
    return dict(zip(stages(figures_), values, strict=False))


def _page(
    figures_: dict[str, Any], table: str, sections: list[tuple[str, str, go.Figure, str]]
) -> str:
    """Return verdict, table and sections as one self-contained HTML text."""
    head = f"{_verdict(figures_)}{table}{_warnings(figures_)}"
    return document(f"{figures_['case']}: {figures_['kind']}", head, sections, _THINNED_TEXT)


def document(
    title: str, head: str, sections: list[tuple[str, str, go.Figure, str]], end: str = ""
) -> str:
    """Return a self-contained HTML text.

    Args:
        title: Title, as plain text.
        head: HTML before the sections.
        sections: Title, name, figure and HTML of each.
        end: HTML after them.
    """
    body = "".join(
        f"<h2>{heading}</h2><div>{text}</div>"
        + to_html(figure, include_plotlyjs=False, full_html=False, div_id=name)
        for heading, name, figure, text in sections
    )
    title = html.escape(title)
    return (
        f'<!DOCTYPE html><html lang="en"><head><meta charset="utf-8"><title>{title}</title>'
        f"<style>{_STYLE}</style><script>{get_plotlyjs()}</script></head><body>"
        f"<h1>{title}</h1>{head}{body}{end}</body></html>"
    )


_CONVERGENCE_TEXT = (
    "Thin lines: how far the robot's answer is from the path that the process saw, for each"
    " evaluation of the process. Thick line: deviation from the desired path after each correction."
)
_FLANKS_TEXT = (
    "A bar while a gear is in its play, a mark where it reaches a flank. The command leads it through"
    " the play as the model says: a wrong backlash would show there."
)
_THINNED_TEXT = (
    f"<p>A curve over time is drawn through its smallest and largest value in each of {PARTS} equal"
    " parts of the time, so that no peak is lost; the CSV files hold every sample.</p>"
)
_GAP_TEXT = (
    "Between the surfaces of both tools, across the sheet; it moves with the deviations of both."
)
_CELL_TEXT = "Desired paths of all tools, in the world frame."
_CUT_TEXT = "What the process leaves, cut along the part's x axis."
_WORKPIECE_TEXT = (
    "The same surface with its fields; choose one in the menu. The files workpiece_*.vtu hold it for"
    " ParaView."
)


def _deviation_text(run: StoredRobot) -> str:
    text = "Distance between actual and desired TCP at equal times."
    if len(run.actual) > 1:
        text += (
            " After compensation it is measured in a simulation of the FMU with the process evaluated"
            " on the path that the tool really takes."
        )
    if run.plant is not None:
        text += " On the plant the same command is as good as model and plant agree."
    return text


def _wrench_text(run: StoredRobot) -> str:
    which = "path after compensation" if len(run.actual) > 1 else "actual path"
    return f"Acting on the tool at the TCP, base axes, along the {which}."


def _path_text(factor: int) -> str:
    return f"Deviations from the desired path are drawn {factor} times as large as they are."


def _verdict(figures_: dict[str, Any]) -> str:
    state = "yes" if figures_["converged"] else "no"
    word = "Converged" if figures_["converged"] else "Not converged"
    return f'<p class="verdict {state}"><b>{word}</b>: {html.escape(figures_["reason"])}</p>'


def _warnings(figures_: dict[str, Any]) -> str:
    items = "".join(f"<li>{html.escape(text)}</li>" for text in figures_["rate_warnings"])
    return f"<h2>Warnings</h2><ul>{items}</ul>" if items else ""
