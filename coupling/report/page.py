"""The report of a run folder."""

from __future__ import annotations

import html
from collections.abc import Mapping
from pathlib import Path

from coupling.errors import ResultError
from coupling.files.whole_file import write_whole
from coupling.path.workpiece import Workpiece
from coupling.report import along, figures, tables, workpiece_figures
from coupling.report.background import case_of, inputs, process_text, real_part
from coupling.report.document import Section, document
from coupling.report.drives import DRIVES_TEXT, drives, drives_table
from coupling.report.thinning import PARTS
from coupling.report.verdict import verdict
from coupling.report.views import PathView, from_above, robot_views
from coupling.results.run_result import RunResult
from coupling.results.run_state import RunCase
from coupling.run.stored_run import StoredRobot, StoredRun, read_run


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
    for place, page in _pages(folder, target, run).items():
        write_whole(place, page, ResultError)
    return target


def _pages(folder: Path, target: Path, run: StoredRun) -> dict[Path, str]:
    """Return the pages of a run by their files."""
    if run.gap is None:
        return {target: robot_page(run, run.first)}
    pages = {
        folder / name / "report.html": robot_page(run, own) for name, own in run.robots.items()
    }
    return {**pages, target: cell_page(run)}


def robot_page(run: StoredRun, robot: StoredRobot) -> str:
    """Return the page of one robot of a run and its tool as one self-contained HTML text."""
    own, case = robot.figures, case_of(run)
    gears = f"{_FLANKS_TEXT}{tables.gears(own.changes)}" if own.changes else ""
    process = process_text(own, case, run.answers)
    part = real_part(own, case)
    views = [PathView(stage, robot.desired, path, part) for stage, path in robot.actual.items()]
    drive_text = f"{DRIVES_TEXT}{drives_table(own)}"
    sections: list[Section] = [
        ("The part from above", "above", from_above(views), _ABOVE_TEXT),
        (
            "Deviation along the path",
            "deviation",
            along.deviation(robot),
            _deviation_text(robot) + gears,
        ),
        ("Robot at the part", "robot", robot_views(own.robots, [robot.desired]), _ROBOT_TEXT),
        *_told("", tables.robustness(own), tables.plant(own), tables.gear_loads(own.gears)),
        ("What the command asks of the drives", "drives", drives(robot), drive_text),
        ("The process: where and at what cost", "convergence", along.convergence(robot), process),
        ("Wrench along the path", "wrench", along.wrench(robot), _wrench_text(robot)),
        ("Deviation by axis", "axes", along.components(robot), _axes_text(robot)),
    ]
    if run.gap is None:
        sections += _of_workpieces(run.workpieces)
    return _page(own, case, tables.deviations(robot), sections, inputs(own, run.case))


def _told(name: str, *parts: str) -> list[Section]:
    """Return a section without figures of parts that have their own headings."""
    return [(name, "", (), "".join(parts))]


def _of_workpieces(workpieces: Mapping[str, Workpiece]) -> list[Section]:
    """Return the sections of what a process leaves, none where it leaves nothing."""
    if not workpieces:
        return []
    return [
        ("Workpiece, cut", "cut", workpiece_figures.cut(workpieces), _CUT_TEXT),
        ("Workpiece", "workpiece", workpiece_figures.fields(workpieces), _WORKPIECE_TEXT),
    ]


def cell_page(cell: StoredRun) -> str:
    """Return the page of a cell, which leads to those of its robots."""
    own, case = cell.figures, case_of(cell)
    rows = [
        (
            f'<a href="{name}/report.html">{name}</a>',
            *(f"{1e6 * found.maximum:.2f}" for found in run.figures.deviations),
            f"{run.figures.peak_force_N:.1f}",
        )
        for name, run in cell.robots.items()
    ]
    header = ("deviation, max [um]", *own.stages, "peak force [N]")
    paths = [run.desired for run in cell.robots.values()]
    robots = [run.figures.robots[0] for run in cell.robots.values()]
    sections: list[Section] = [
        ("Gap between the tools", "gap", figures.gap(cell), _GAP_TEXT),
        ("Robots in the cell", "robot", robot_views(robots, paths), _ROBOT_TEXT),
        *_told("", tables.robustness(own), tables.plant(own)),
        (
            "The process: where and at what cost",
            "convergence",
            along.convergence(cell.first),
            process_text(own, case, cell.answers),
        ),
        *_of_workpieces(cell.workpieces),
    ]
    return _page(own, case, tables.table(header, rows), sections, inputs(own, cell.case))


def _page(
    figures_: RunResult,
    case: RunCase,
    table: str,
    sections: list[Section],
    end: str,
) -> str:
    """Return verdict, table, sections and inputs as one self-contained HTML text."""
    head = f"{verdict(figures_, case.process.model)}{table}{_warnings(figures_)}"
    title = f"{figures_.case}: {figures_.kind}"
    return document(title, head, sections, f"{_THINNED_TEXT}{end}")


_ABOVE_TEXT = (
    "<p>The path along the part's z axis, coloured by the distance of the actual from the desired TCP,"
    " all on one logarithmic scale.</p>"
)
_FLANKS_TEXT = (
    "<p>Below the curves: a bar while a gear is in its backlash, a mark where it reaches a flank. The"
    " command leads it through the backlash as the model says: a wrong backlash would show there. The"
    " largest spikes of each gear are named.</p>"
)
_ROBOT_TEXT = (
    "<p>Links from joint to joint in the middle of the path, no bodies; the world frame.</p>"
)
_THINNED_TEXT = (
    f"<p>A curve over time is drawn through its smallest and largest value in each of up to {PARTS}"
    " equal parts of the time, so that no peak is lost; the CSV files hold every sample.</p>"
)
_GAP_TEXT = (
    "Between the surfaces of both tools, across the sheet; it moves with the deviations of both."
)
_CUT_TEXT = "What the process leaves, cut along the part's x axis."
_WORKPIECE_TEXT = (
    "The same surface with its fields; choose one in the menu. The files workpiece_*.vtu hold it for"
    " ParaView."
)


def _deviation_text(run: StoredRobot) -> str:
    text = "<p>Distance between actual and desired TCP at equal times."
    if len(run.actual) > 1:
        text += (
            " After compensation it is measured in a simulation of the FMU with the process evaluated"
            " on the path that the tool really takes."
        )
    if run.other:
        text += " Dotted: the same command and wrench on the robot in the other mode."
        if len(run.actual) > 1 and run.figures.mode == "dynamic":
            text += " After compensation they are apart by the command's share against inertia."
    if run.plant is not None:
        text += " On the plant the same command is as good as model and plant agree."
    return f"{text}</p>"


def _wrench_text(run: StoredRobot) -> str:
    which = "path after compensation" if len(run.actual) > 1 else "actual path"
    return f"Acting on the tool at the TCP, base axes, along the {which}."


def _axes_text(run: StoredRobot) -> str:
    first, *more = run.actual
    return f"Actual minus desired TCP{f' {first}' if more else ''}, world axes."


def _warnings(figures_: RunResult) -> str:
    # A run of an earlier version has warned of rates alone.
    warned = tuple(own.text for own in figures_.warnings) or figures_.rate_warnings
    lists = {"Warnings": warned, "Remarks": figures_.remarks}
    return "".join(
        f"<h2>{title}</h2><ul>{''.join(f'<li>{html.escape(text)}</li>' for text in texts)}</ul>"
        for title, texts in lists.items()
        if texts
    )
