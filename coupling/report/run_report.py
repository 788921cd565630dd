"""The report of a run folder."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import replace
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np
import plotly.graph_objects as go

from coupling.files.written_files import LEARNING
from coupling.path.workpiece import Workpiece
from coupling.report import run_figures, run_tables, workpiece_figures
from coupling.report.background import (
    case_content,
    case_of,
    cost,
    evaluations_table,
    inputs,
    real_part,
    tolerance_of,
    touched_off,
)
from coupling.report.colours import AFTER, BEFORE, DESIRED
from coupling.report.cut_report import cut_section
from coupling.report.drives import DRIVES_NOTE, drives, drives_table
from coupling.report.report_file import name_path
from coupling.report.result_report import ResultReport
from coupling.report.run_answer import run_answer
from coupling.report.run_scene import part_frame, run_scene, tool_of, tracks_of
from coupling.report.run_steps import RunContext
from coupling.report.shares import DeviationShares, shares_of
from coupling.report.style import DrawnLine, over_time, rule
from coupling.report.thinning import PARTS
from coupling.report.verdict import verdict
from coupling.report.workpiece_figures import tool_envelope
from coupling.results.run_result import RunResult, shown_name
from coupling.results.scene import Scene
from coupling.results.section import Answer, Note, Part, Section, warned
from coupling.run.checks import check_sections
from coupling.run.stored_run import CASE, FORMING, StoredRobot, StoredRun


def run_report(run: StoredRun) -> ResultReport:
    """Return what is told of a run, of one robot or of a whole cell."""
    if run.gap is None:
        return _report(run, partial(_robot_sections, run, run.first))
    parts = {}
    for name, robot in run.robots.items():
        alone = replace(run, figures=robot.figures, robots={name: robot})
        parts[name] = _report(alone, partial(_robot_sections, run, robot))
    return replace(_report(run, partial(_cell_sections, run)), parts=parts)


def _report(run: StoredRun, sections: Callable[[], list[Section]]) -> ResultReport:
    figures = run.figures
    return ResultReport(
        figures.kind,
        figures.case,
        _answer(run),
        lambda: [*sections(), Section("", [_THINNED]), *inputs(figures, run.case)],
        warnings=run_warnings(figures),
        scene=partial(_scene, run),
        outline=partial(_outline, run),
    )


def _scene(run: StoredRun) -> Scene:
    return run_scene(run, part_frame(real_part(run.figures, case_of(run))), case_content(run))


def _outline(run: StoredRun) -> Scene:
    """Return the paths of a run's tools before compensation."""
    tracks = [tracks_of(robot)[0] for robot in run.robots.values()]
    frame = part_frame(real_part(run.figures, case_of(run)))
    return Scene(tracks=tracks, world_from_part=frame)


def _answer(run: StoredRun) -> Answer:
    case = case_content(run)
    context = RunContext(
        folder=name_path(run.folder),
        case=name_path(Path(run.case_file or run.folder / CASE)),
        robots={
            robot.name: case.get("robot" if robot.name == FORMING else robot.name, {}).get(
                "description", robot.description
            )
            for robot in run.figures.robots
        },
        tolerance=tolerance_of(run),
        learning=_learning_page(run),
    )
    return run_answer(run.figures, context)


def _learning_page(run: StoredRun) -> str:
    """Return the page of how a command was learned, beside its case; empty where there is none."""
    is_learned = run.figures.forecast is not None and run.case_file
    return name_path(Path(run.case_file).with_name(LEARNING)) if is_learned else ""


def robot_head(run: StoredRun, robot: StoredRobot) -> list[Section]:
    """Return what one robot of a run comes to."""
    parts = [shares_of(robot, stage) for stage in robot.actual]
    return _head(run, robot.figures, run_tables.deviations(robot.figures, parts))


def cell_head(cell: StoredRun) -> list[Section]:
    """Return what a cell comes to."""
    figures, gap = cell.figures, cell.figures.pinch_gap_m
    assert gap is not None
    robots = [(name, run.figures.deviations) for name, run in cell.robots.items()]
    ends = (
        (gap.narrowest_before, gap.widest_before),
        (gap.narrowest_after, gap.widest_after),
    )
    gaps = ", ".join(
        f"{1e3 * low:.3f} to {1e3 * high:.3f} mm {shown_name(stage)}"
        for (low, high), stage in zip(ends, figures.stages, strict=False)
    )
    text = f"Gap between the tools, commanded {1e3 * gap.commanded:.3f} mm: {gaps}."
    links = [
        Note(f"{name} robot: peak force {run.figures.peak_force_N:.1f} N", f"{name}/report.html")
        for name, run in cell.robots.items()
    ]
    parts = [
        DeviationShares.worst([shares_of(run, stage) for run in cell.robots.values()])
        for stage in figures.stages
    ]
    table = run_tables.deviations(figures, parts, robots)
    return _head(cell, figures, replace(table, parts=(*table.parts, text, *links)))


def _head(run: StoredRun, figures_: RunResult, deviations: Section) -> list[Section]:
    """Return verdict, deviations and touch-off."""
    return [
        replace(
            verdict(figures_, case_of(run).process.model), title="How it was computed", good=None
        ),
        deviations,
        Section("", touched_off((warning.name, warning.touch_off) for warning in figures_.robots)),
    ]


def run_warnings(figures: RunResult) -> list[Section]:
    """Return the section of a run's warnings and remarks; none where there are none."""
    # A run of an earlier version has warned of rates alone.
    warnings = tuple(warning.text for warning in figures.warnings) or figures.rate_warnings
    return warned(warnings, figures.remarks)


def _robot_sections(run: StoredRun, robot: StoredRobot) -> list[Section]:
    """Return the sections on one robot of a run and its tool."""
    figures, part, case = robot.figures, real_part(robot.figures, case_of(run)), case_content(run)
    along_text = [_deviation_note(robot)] + ([_FLANKS] if figures.reversals else [])
    demands = (DRIVES_NOTE, drives_table(figures.command.drives))
    tolerance = tolerance_of(run)
    along, on_part = (
        draw(robot, tolerance) for draw in (run_figures.deviation, run_figures.components)
    )
    return [
        *_of_process(run, robot, part, case),
        *robot_head(run, robot),
        Section("Deviation along the path", along_text, "deviation", [along]),
        Section("Deviation on the part", [_PART_AXES], "axes", [on_part]),
        *check_sections(figures),
        Section("Demands on the drives", demands, "drives", [drives(robot)]),
        _process(run, robot),
        _wrench(robot),
    ]


def _of_process(
    run: StoredRun, robot: StoredRobot, part: Mapping[str, Any], case: Mapping[str, Any]
) -> list[Section]:
    """Return what the process leaves and does: the formed part, or teeth and engagement of a cut."""
    teeth = run_figures.tooth_passings(robot)
    sections = [Section("Force as teeth pass", [_TEETH], "teeth", teeth)] if teeth else []
    sections += cut_section(robot.figures.cut)
    if run.gap is not None or not run.workpieces:
        return sections
    tool = tool_of(case.get("process", {}))
    envelope = None
    if tool is not None and tool.is_round:
        envelope = tool_envelope(robot.desired, part_frame(part), 0.5 * tool.diameter)
    return [*sections, *_of_workpieces(run.workpieces, envelope)]


def _process(run: StoredRun, robot: StoredRobot) -> Section:
    """Return where the process of a run was evaluated, and what that cost."""
    costs = cost(robot.figures, case_of(run), run.answers)
    parts: list[Part] = [*costs, *evaluations_table(run.answers), _CONVERGENCE]
    title = "Evaluations of the process"
    return Section(title, parts, "convergence", [run_figures.convergence(robot)])


def _of_workpieces(
    workpieces: Mapping[str, Workpiece], envelope: np.ndarray | None = None
) -> list[Section]:
    """Return the sections of what a process leaves, none where it leaves nothing."""
    if not workpieces:
        return []
    shown = {shown_name(stage): piece for stage, piece in workpieces.items()}
    figure = workpiece_figures.cut(shown, envelope)
    return [Section("Section of the workpiece", [_CUT, _WORKPIECE], "cut", [figure])]


def _cell_sections(cell: StoredRun) -> list[Section]:
    return [
        *cell_head(cell),
        Section("Gap between the tools", [_GAP], "gap", [gap_figure(cell)]),
        *check_sections(cell.figures),
        _process(cell, replace(cell.first, figures=cell.figures)),
        *_of_workpieces(cell.workpieces),
    ]


def gap_figure(cell: StoredRun) -> go.Figure:
    """Gap between the tools of a cell over time, actual and as commanded."""
    assert cell.gap is not None
    assert cell.figures.pinch_gap_m is not None
    time = cell.first.desired.time
    stages = zip(cell.figures.stages, (BEFORE, AFTER), cell.gap.T, strict=False)
    lines = [
        DrawnLine(shown_name(name), color, time, 1e3 * values, 2.0)
        for name, color, values in stages
    ]
    commanded = 1e3 * cell.figures.pinch_gap_m.commanded
    level = rule("y", commanded, color=DESIRED, dash="dash", width=1)
    return over_time(lines, "gap [mm]", 320, shapes=[level])


_FLANKS = Note(
    "Bars below the curves: a gear is in its backlash; marks: it reaches a flank. The largest spikes of"
    " each gear are labelled where they can be seen."
)
_PART_AXES = Note(
    "Actual minus desired TCP: normal to the part, positive away from it, along the feed, and across"
    " both. Before and after on one scale; dashed: the tolerance of the part, where it is stated."
)
_CONVERGENCE = Note(
    "Thin lines: distance of the robot's path from that on which the process was evaluated, for each"
    " evaluation. Thick line: deviation from the desired path after each correction."
)
_THINNED = Note(
    f"Curves over time show the smallest and largest value in each of up to {PARTS} equal intervals;"
    " the CSV files contain every sample."
)
_GAP = Note(
    "Gap between the surfaces of both tools, across the sheet; it varies with the deviations of both."
)
_TEETH = Note(
    "Force on the tool, base axes, as long as a few teeth pass, where it is largest; dashed: means over"
    " this time."
)
_CUT = Note(
    "Section of the workpiece along the part's x axis; dotted: the lowest surface that a tool on the"
    " desired path sweeps."
)
_WORKPIECE = Note(
    "The view in space above shows it with its fields; the files workpiece_*.vtu contain it for"
    " ParaView."
)


def _deviation_note(run: StoredRobot) -> Note:
    text = "Distance between actual and desired TCP at equal times."
    if run.expected is not None:
        text += (
            " To be expected: on the worst of the robots that are drawn from what is known of it."
        )
    if len(run.actual) > 1:
        text += " After, if the file is right: simulated, with the process on the actual path."
    if run.other:
        text += " Dotted, shown by its name above: the same command and wrench in the other mode."
        if len(run.actual) > 1 and run.figures.mode == "dynamic":
            text += " After it they differ, as the command compensates inertia."
    if run.plant is not None:
        text += " Plant: the same command on the robot that differs from the model."
    return Note(text)


def _wrench(run: StoredRobot) -> Section:
    title = "Force on the tool along the path"
    if not run.wrench.wrench.any():
        return Section(title, [Note("None: no process acts on the tool.")])
    which = "Force and moment at the TCP along the actual path"
    if len(run.actual) > 1:
        which += " under the corrected command, if the file is right"
    note = f"{which}; base axes; dashed: means over time."
    return Section(title, [Note(note)], "wrench", [run_figures.wrench(run)])
