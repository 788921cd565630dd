"""elastic-robot next | learn | mirror: from what was measured under a command to the next one."""

from __future__ import annotations

import inspect
import math
import shlex
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from coupling.cli.arguments import (
    STORE,
    Columns,
    DespiteChatter,
    MeasuredRuns,
    NoStore,
    Overwrite,
    OwnFrame,
    StoreFolder,
    Unit,
    Verbose,
    column_choice,
    pairs_of,
    store_folder,
)
from coupling.cli.console import console
from coupling.cli.device_accuracy import device_accuracy, length_of
from coupling.cli.runs import NOT_CONVERGED, ended_by_chatter, print_run
from coupling.errors import LearnError
from coupling.events import Watch
from coupling.files.atomic_file import write_atomically

if TYPE_CHECKING:
    from coupling.case.case import Case
    from coupling.identification.next.command import CommandPlan
    from coupling.identification.next.options import FrameAccuracy, NextOptions
    from coupling.report.result_report import ResultReport
    from coupling.results.learned_result import LearnedResult
    from coupling.results.next_result import NextResult
    from coupling.run.execute import Run

# Of a deviation that is slower a path has no period [Hz].
_LOWEST_CUTOFF = 0.01
# Exit status where no parameter is identifiable.
REFUSED = 1

NextRun = Annotated[Path, typer.Option("-o", "--output", help="Run folder of the next command.")]
Cutoff = Annotated[
    float | None,
    typer.Option(
        "--cutoff-Hz",
        help="Frequency up to which the path is corrected; the highest that converges unless given.",
    ),
]
Known = Annotated[
    str | None,
    typer.Option(
        "--frame-known",
        metavar="LENGTH,ANGLE",
        help="Uncertainty of the measuring frame in the robot's base frame, as 0.05mm or"
        " 0.05mm,0.05mrad; with it the absolute position is corrected too.",
    ),
]
Tip = Annotated[
    str | None,
    typer.Option(
        "--tip-known",
        metavar="LENGTH",
        help="Uncertainty of the position of the probe's tip relative to the TCP, as 0.5mm; it is"
        " identified where the tool rotates.",
    ),
]
ClockKnown = Annotated[
    bool,
    typer.Option(
        "--clock-known",
        help="Measured times are those of the command: a delay of the robot is corrected.",
    ),
]
Repeatability = Annotated[
    str | None,
    typer.Option(
        metavar="LENGTH",
        help="Repeatability of the robot in this cell, RP of ISO 9283; 0.02mm unless given.",
    ),
]
InputsOnly = Annotated[
    bool,
    typer.Option(
        "--inputs-only", help="Write robot file, case and report, and compute no command."
    ),
]


def next_command(
    runs: MeasuredRuns,
    output: NextRun,
    move: Annotated[
        str,
        typer.Option(
            help="What is learned: auto, parameters, path, both; auto: parameters from two runs,"
            " and the path."
        ),
    ] = "auto",
    frame_known: Known = None,
    own_frame: OwnFrame = False,
    columns: Columns = None,
    unit: Unit = None,
    tip_known: Tip = None,
    clock_known: ClockKnown = False,
    cutoff_hz: Cutoff = None,
    repeatability: Repeatability = None,
    inputs_only: InputsOnly = False,
    overwrite: Overwrite = False,
    store: StoreFolder = None,
    no_store: NoStore = False,
    despite_chatter: DespiteChatter = False,
    verbose: Verbose = False,
) -> None:
    """Compute the next command from measurements under the previous ones."""
    from coupling.files.atomic_folder import exclusively, require_free
    from coupling.identification.next.command import plan
    from coupling.identification.next.figures import figures
    from coupling.identification.next.inputs import (
        begin_inputs,
        case_file,
        inputs_folder,
        require_inputs_folder,
        write_inputs,
    )
    from coupling.identification.runs.measurement import read_measurement
    from coupling.identification.runs.source import read_source
    from coupling.report.next_report import next_answer, next_report, refused_answer
    from coupling.report.report_file import name_path
    from coupling.report.run_report import run_report
    from coupling.report.terminal import print_report
    from coupling.run.console import RunView
    from coupling.run.fmu_pool import FmuPool
    from coupling.run.run_log import is_to_go_on
    from coupling.run.stored_run import CASE as RUN_CASE
    from coupling.run.unfinished_folder import RUN_FOLDER
    from coupling.run_to_folder import limits_to_folder, run_to_folder

    frame_accuracy = device_accuracy(frame_known, own_frame, tip_known, clock_known)
    options = _options(move, frame_accuracy, cutoff_hz, repeatability)
    choice = column_choice(columns, unit)
    known = [("--frame-known", frame_known), ("--tip-known", tip_known)]
    known += [("--columns", columns), ("--unit", unit)]
    stated = [word for option, value in known if value for word in (option, value)]
    stated += ["--own-frame"] * own_frame + ["--clock-known"] * clock_known
    pairs = pairs_of(runs)
    place = inputs_folder(output)
    require_inputs_folder(place)
    if any(output.resolve() == folder.resolve() for folder, _ in pairs):
        raise LearnError(f"{output}: expected another folder than those of the measured runs")
    sources = [read_source(folder, read_measurement(file, choice)) for folder, file in pairs]
    case_name = sources[-1].stored.figures.case
    goes_on = is_to_go_on(output, "compensate", case_file(place, case_name))
    if not inputs_only:
        require_free(output, RUN_FOLDER, overwrite or goes_on)  # before the work that would be lost
    for (_, file), source in zip(pairs, sources, strict=True):
        if source.measured.understood is not None:
            console.print(f"{file}: {source.measured.understood.sentence}.")
    title = f"{case_name}, from {' and '.join(file.name for _, file in pairs)}"
    words = ["next", *map(str, runs)]
    judged = (
        None if despite_chatter else (*words, "--move", options.move, *stated, "-o", str(output))
    )
    with (
        ended_by_chatter(output, verbose),
        exclusively(place, LearnError),
        RunView(console, verbose) as view,
        FmuPool("native", view.watch) as models,
    ):
        if judged is not None:
            last = pairs[-1][0] / RUN_CASE
            limits_to_folder(last, output, overwrite, "compensate", judged, view.watch)
        command_plan = plan(sources, options, models, view.watch)
        begin_inputs(place)
        result = figures(command_plan)
        learned = None if command_plan.learned is None else command_plan.learned.result
        if command_plan.is_refused:
            answer = refused_answer(result, [*words, "--move", "path", *stated, "-o", str(output)])
        else:
            case = write_inputs(place, command_plan)
            words += [str(output), "measured.csv", *_move_words(options.move), *stated]
            words += ["-o", f"{output}_next"]
            answer = next_answer(result, name_path(case), sources[-1].robot.name, words)
        report = next_report(title, result, learned, answer, command_plan.history.runs)
        page = _write_report(place, report, result, learned)
        if command_plan.is_refused or inputs_only:
            print_report(console, report, verbose)
            console.print(f"Report: {page}")
            raise typer.Exit(REFUSED if command_plan.is_refused else 0)
        shared_store = store or (None if no_store else pairs[-1][0].parent / STORE)
        evaluations = store_folder(output, shared_store, no_store)

        def work(case_of_run: Case, watch: Watch, store: Path | None) -> Run:
            return expected(case_of_run, command_plan, watch, store)

        try:
            finished = run_to_folder(
                case, output, overwrite, evaluations, "compensate", work, view.watch, judged
            )
        except KeyboardInterrupt as stop:
            words = ["elastic-robot", "compensate", str(case), "-o", str(output)]
            stop.add_note(
                f"the learned robot and the case are kept in {place}; the command alone, without its"
                f" forecast: {shlex.join(words)}"
            )
            raise
        result = figures(command_plan, finished.run.forecast)
        answer = next_answer(result, name_path(output), sources[-1].robot.name, words)
        report = next_report(title, result, learned, answer, command_plan.history.runs)
        _write_report(place, report, result, learned)
    if finished.is_good:
        print_report(console, report.before(run_report(finished.stored)), verbose)
        console.print(f"Result: {output}  (report: {output / 'report.html'})")
    else:
        print_run(finished, output, verbose)
    console.print(f"Report on the learning: {page}")
    if not finished.run.correction.converged:
        raise typer.Exit(NOT_CONVERGED)


def _with_move(name: str, move: str, text: str) -> Callable[..., None]:
    """Return the command with one move, as a command without that option."""
    signature = inspect.signature(next_command, eval_str=True)
    parameters = [value for name, value in signature.parameters.items() if name != "move"]

    def short_form(**arguments: Any) -> None:
        next_command(**arguments, move=move)

    short_form.__name__, short_form.__doc__ = name, text
    short_form.__signature__ = signature.replace(parameters=parameters)  # type: ignore[attr-defined]
    return short_form


learn = _with_move(
    "learn",
    "parameters",
    "Learn backlash, stiffness and damping, and compute the next command: next --move parameters.",
)
mirror = _with_move(
    "mirror", "path", "Learn along the path alone: next --move path, no parameters are fitted."
)


def _options(
    move: str,
    frame_accuracy: FrameAccuracy,
    cutoff: float | None,
    repeatability: str | None,
) -> NextOptions:
    from coupling.identification.next.options import KINDS, REPEATABILITY, NextOptions

    if move not in KINDS:
        raise LearnError(f"--move: expected one of {', '.join(KINDS)}, got {move!r}")
    if cutoff is not None and not _LOWEST_CUTOFF <= cutoff < math.inf:
        raise LearnError(
            f"--cutoff-Hz: expected a frequency of {_LOWEST_CUTOFF:g} Hz or more, got {cutoff:g}"
        )
    repeatability_m = REPEATABILITY
    if repeatability is not None:
        repeatability_m = length_of("--repeatability", repeatability, "0.05mm")
    return NextOptions(frame_accuracy, move, cutoff, repeatability_m)


def _move_words(move: str) -> list[str]:
    """Return the option by which the next command is learned in the same way."""
    return [] if move == "auto" else ["--move", move]


def _write_report(
    place: Path, report: ResultReport, result: NextResult, learned: LearnedResult | None
) -> Path:
    """Write how a command was computed, page and figures; return the page."""
    from coupling.files.written_files import LEARNING
    from coupling.identification.next.inputs import LEARNED, PLAN

    write_atomically(place / PLAN, result.text() + "\n", LearnError)
    if learned is not None:
        write_atomically(place / LEARNED, learned.text() + "\n", LearnError)
    page = place / LEARNING
    write_atomically(page, report.page, LearnError)
    return page


def expected(case: Case, command_plan: CommandPlan, watch: Watch, store: Path | None = None) -> Run:
    """Return the run of the next command, with what it is expected to leave."""
    from coupling.identification.next.forecast import forecast
    from coupling.run.execute import run_compensation

    run = run_compensation(case, watch, store, is_measured=True)
    correction, base_from_world = run.correction, case.robots[0].world_from_base.inverse()
    wrench = correction.response.wrench.transformed(base_from_world)
    return replace(run, forecast=forecast(command_plan, correction.joints, wrench))
