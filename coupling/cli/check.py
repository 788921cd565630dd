"""The command line: elastic-robot check."""

from __future__ import annotations

import time
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, NoReturn

import typer

from coupling.cli.arguments import CaseFile, Verbose
from coupling.cli.console import console
from coupling.cli.runs import BAD_INPUT, NOT_CONVERGED
from coupling.events import Progress

if TYPE_CHECKING:
    from coupling.case.case import Case
    from coupling.report.result_report import ResultReport

_NONE = (
    "Estimated time of a compensation: none, as it ends where the cut chatters (--despite-chatter)"
)
_UNTOUCHED = (
    "A command that is corrected keeps the depth of the cut; without a correction a robot that sags and"
    " was not touched off cuts deeper, as couple judges it."
)


def check(
    case: CaseFile,
    output: Annotated[
        Path | None,
        typer.Option(
            "-o", "--output", help="Page; <case>_check.html beside the case unless given."
        ),
    ] = None,
    evaluate: Annotated[
        bool,
        typer.Option(
            "--evaluate",
            help="Evaluate the process on the desired path, twice if that takes less than a"
            " minute, and keep nothing of it. Without it the robot carries only its weight.",
        ),
    ] = False,
    verbose: Verbose = False,
) -> None:
    """Check whether a case can be run, draw its path and estimate the time; no command is computed."""
    from coupling.case.file import TouchOffError, load_case
    from coupling.check.robot_findings import examine_robots
    from coupling.check.run_effort import check_repeatability, warn_of_memory
    from coupling.errors import CaseError, ResultError, cause_of
    from coupling.files.output_file import require_output
    from coupling.modes.analysis import places_in_brief
    from coupling.path.histories import WrenchHistory
    from coupling.path.path_ends import ends_in_motion
    from coupling.process import ProcessTable
    from coupling.report.background import touched_off
    from coupling.report.blocked_report import blocked_report
    from coupling.report.check_report import check_answer, check_report, check_summary
    from coupling.report.cut_report import cut_section
    from coupling.report.modes_report import modes_in_brief
    from coupling.report.report_file import write_page
    from coupling.report.terminal import print_report
    from coupling.results.section import Section, warned
    from coupling.robot.blocked_path import UnreachableError
    from coupling.run.console import RunView
    from coupling.run.cut_figures import cut_result
    from coupling.run.gear_loads import planned_joints
    from coupling.run.plausibility import remarks
    from coupling.run.repeated_evaluation import noise_removal
    from coupling.run.robot_results import touch_off_of
    from coupling.stability.path_stability import stability_in_brief

    # Of a folder's name, which is no case, as well.
    file = output or case.parent / f"{case.stem}_check.html"

    def end_blocked(report: ResultReport) -> NoReturn:
        write_page(file, report.page, ResultError)
        print_report(console, report, verbose)
        console.print(f"Page: {file}")
        raise typer.Exit(BAD_INPUT)

    with RunView(console) as view:
        require_output(file, ".html", ResultError)
        view.watch(Progress("reading the case and its path", 0, 1))
        try:
            loaded = load_case(case, watch=view.watch)
        except CaseError as error:
            touch, unreachable = cause_of(error, TouchOffError), cause_of(error, UnreachableError)
            if touch is None or unreachable is None:
                raise
            untouched = load_case(case, watch=view.watch, touches_off=False)
            end_blocked(blocked_report(untouched, unreachable, case, touch))
        desired = loaded.desired
        if much := warn_of_memory(desired):
            console.print(much)
        try:
            rigid = planned_joints(loaded.robots, desired)
        except UnreachableError as error:
            end_blocked(blocked_report(loaded, error, case))
        wrench, each = WrenchHistory.none(desired.time, len(desired.pose)), None
        said, alike = remarks(loaded), []
        loads = "the robot's own weight, without the process (--evaluate)"
        if evaluate:
            removal = noise_removal(loaded, view.watch)
            process = loaded.evaluated_process(None, view.watch, removal)
            wrench = process.evaluate(desired).wrench
            assert process.last is not None
            each, said = process.last.seconds, remarks(loaded, wrench)
            if removal is not None and removal.noise is not None:
                said = (*said, *removal.noise.remarks)
            if removal is not None and removal.repeatability is not None:
                alike = [removal.repeatability.sentence()]
            elif isinstance(loaded.process_table, ProcessTable):
                alike = [check_repeatability(process, process.last)]
            loads = f"weight and process, at most {wrench.peak_force:.0f} N"
        view.watch(Progress("checking joints and gears", 0, 1))
        robots = examine_robots(loaded, wrench, view.watch, evaluate, rigid)
        modes = Section("Modes", modes_in_brief(places_in_brief(loaded)))
        stability = stability_in_brief(loaded)
    touches = touched_off((robot.name, touch_off_of(loaded, robot)) for robot in loaded.robots)
    chatters = stability is not None and not stability.stable
    duration = _NONE if chatters else _time(loaded, each)
    others = [*alike, *loaded.task.remarks, *touches, duration]
    moving = ends_in_motion(desired, tuple(placed.name for placed in loaded.robots))
    if stability is not None and stability.stable and not any(touches):
        modes = replace(modes, parts=[*modes.parts, _UNTOUCHED])
    warnings = warned((), (*moving, *said))
    sections = [
        *check_summary(robots, loads),
        *cut_section(cut_result(loaded)),
        modes,
        Section("", others),
    ]
    answer = check_answer(robots, loaded.resolved, case, loads, stability)
    with RunView(console) as view:
        view.watch(Progress("drawing the page", 0, 1))
        report = check_report(loaded.title, robots, loaded.resolved, sections, warnings, answer)
        write_page(file, report.page, ResultError)
    print_report(console, report, verbose)
    if not verbose:
        # Whoever does not ask must know what of the program was left out.
        for sentence in (*loaded.task.remarks, others[-1]):
            console.print(sentence)
    console.print(f"Page: {file}")
    if chatters:
        raise typer.Exit(NOT_CONVERGED)


def _time(case: Case, each: float | None) -> str:
    """Return what there is to say of the time that a compensation would take."""
    import numpy as np

    from coupling.check.run_effort import estimate_run
    from coupling.process.base import marched
    from coupling.run.expected_robots import draw_counts
    from coupling.solve.inverse import InverseCorrection

    if each is None and case.process_table.FORMULA:
        start = time.perf_counter()
        case.process.evaluate(case.desired)
        each = time.perf_counter() - start
    if isinstance(case.method, InverseCorrection):
        draws = sum(draw_counts(case.fmu, len(case.desired.time) * len(case.robots)))
        servos = any(placed.drive == "servo" for placed in case.robots)
        marching = marched(case.process) if case.process_table.FORMULA else None
        steps = 0.0 if marching is None else np.ptp(case.desired.time) / marching.memory.step
        return estimate_run(
            case.desired, case.controller, case.method.max_rounds, each, draws, servos, float(steps)
        )
    return (
        "Estimated time of a compensation: none for this method, which iterates robot and process"
    )
