"""The command line: elastic-robot identify."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from coupling.cli.arguments import Verbose
from coupling.cli.console import console
from coupling.errors import IdentifyError, one_of, sentence
from coupling.files.atomic_file import make_folder_of

if TYPE_CHECKING:
    from coupling.identification.static.measurements import MeasurementNoise, Measurements
    from coupling.identification.static.plan import PlanRequest
    from coupling.report.result_report import ResultReport
    from elastic_robot.description import Robot

_PLAN, _MOTION, _CUTTING = "Plan", "Motion", "Cutting"
_RESPONSE = "Frequency responses"


def identify(
    measurements: Annotated[
        list[Path] | None,
        typer.Argument(
            help="A CSV file of measured deflections, optional with --plan; or recordings of a motion;"
            " frequency responses (CSV, UFF58) and hammer tests; or forces in milled slots."
        ),
    ] = None,
    robot: Annotated[
        str, typer.Option(help="Start values: robot.toml or a shipped robot's name.")
    ] = "icme2008",
    output: Annotated[
        Path | None,
        typer.Option(
            "-o", "--output", help="Robot file, with the report in the same folder; or the plan."
        ),
    ] = None,
    torque_curve: Annotated[
        str, typer.Option(help="Torque curve of the gears: linear, backlash or spline.")
    ] = "backlash",
    sd_m: Annotated[
        float | None, typer.Option("--sd-m", help="Standard deviation of positions [m].")
    ] = None,
    sd_rad: Annotated[
        float | None, typer.Option("--sd-rad", help="Standard deviation of rotations [rad].")
    ] = None,
    sd_n: Annotated[
        float | None, typer.Option("--sd-N", help="Standard deviation of forces [N].")
    ] = None,
    sd_nm: Annotated[
        float | None, typer.Option("--sd-Nm", help="Standard deviation of moments [N m].")
    ] = None,
    loss: Annotated[
        str, typer.Option(help="Loss function: squares, or huber for outliers.")
    ] = "squares",
    add: Annotated[
        list[str] | None,
        typer.Option(help="Tilt or backlash to add, as listed, or 'supported'; may be repeated."),
    ] = None,
    hold_out: Annotated[
        list[Path] | None,
        typer.Option(
            help="Recording or response that is predicted, not fitted; may be repeated.",
            rich_help_panel=_MOTION,
        ),
    ] = None,
    bandwidth: Annotated[
        float,
        typer.Option(
            "--bandwidth-Hz",
            min=0.1,
            help="Low-pass filter of the motors' angles.",
            rich_help_panel=_MOTION,
        ),
    ] = 20.0,
    diameter_mm: Annotated[
        float | None, typer.Option(help="Diameter of the cutter.", rich_help_panel=_CUTTING)
    ] = None,
    teeth: Annotated[
        int | None, typer.Option(help="Number of its teeth.", rich_help_panel=_CUTTING)
    ] = None,
    helix_deg: Annotated[
        float | None, typer.Option(help="Helix of its edges.", rich_help_panel=_CUTTING)
    ] = None,
    rpm: Annotated[
        float | None, typer.Option(help="Speed of the spindle.", rich_help_panel=_CUTTING)
    ] = None,
    depth_mm: Annotated[
        float | None, typer.Option(help="Axial depth of the slots.", rich_help_panel=_CUTTING)
    ] = None,
    case: Annotated[
        Path | None,
        typer.Option(
            help="Milling case to write anew, with coefficients and run-out.",
            rich_help_panel=_CUTTING,
        ),
    ] = None,
    posture_deg: Annotated[
        list[str] | None,
        typer.Option(
            metavar="Q1,..,Qn",
            help="Joint angles [deg] of a file of frequency responses; repeated for each of them.",
            rich_help_panel=_RESPONSE,
        ),
    ] = None,
    verbose: Verbose = False,
    plan: Annotated[
        bool, typer.Option("--plan", help="Plan further measurements.", rich_help_panel=_PLAN)
    ] = False,
    count: Annotated[
        int, typer.Option(min=1, help="Number of measurements.", rich_help_panel=_PLAN)
    ] = 20,
    force: Annotated[
        float, typer.Option(min=1e-3, help="Load [N].", rich_help_panel=_PLAN)
    ] = 500.0,
    down: Annotated[
        bool, typer.Option("--down", help="Loads are weights, downwards.", rich_help_panel=_PLAN)
    ] = False,
    lowest_m: Annotated[
        float | None, typer.Option(help="Least height of the tool [m].", rich_help_panel=_PLAN)
    ] = None,
    seed: Annotated[int, typer.Option(min=0, help="Seed of the poses.", rich_help_panel=_PLAN)] = 1,
) -> None:
    """Identify a robot from deflections, motion or responses, a material from cuts; or plan."""
    from coupling.cli.fitted import fitted_target
    from coupling.cli.identify_kinds import (
        identify_from_cuts,
        identify_from_motion,
        identify_responses,
        write_robot,
    )
    from coupling.files.robot_file import find_robot, load_robot
    from coupling.identification.cutting.slots import is_cutting
    from coupling.identification.least_squares import LOSSES
    from coupling.identification.motion.recording import is_recording
    from coupling.identification.response.posture import is_response
    from coupling.identification.static.fit import IdentifyOptions
    from coupling.identification.static.identification import identify as identified
    from coupling.identification.static.measurements import noise_of, read_measurements
    from coupling.identification.static.plan import PlanRequest
    from coupling.report.identify_answers import deflection_answer
    from coupling.report.identify_report import deflection_sections
    from coupling.report.terminal import print_report
    from elastic_robot.torque_curves import TORQUE_CURVES

    _require(torque_curve, TORQUE_CURVES, "--torque-curve")
    _require(loss, LOSSES, "--loss")
    files = measurements or []
    if files and not plan and is_response(files[0]):
        identify_responses(
            robot, files, hold_out or (), posture_deg or (), torque_curve, output, verbose
        )
        return
    if posture_deg:
        raise IdentifyError(
            "--posture-deg: expected files of frequency responses beside it, got none"
        )
    if files and not plan and is_recording(files[0]):
        identify_from_motion(robot, files, hold_out or (), bandwidth, output, verbose)
        return
    if files and not plan and is_cutting(files[0]):
        cut = diameter_mm, teeth, helix_deg, rpm, depth_mm
        identify_from_cuts(files[0], cut, case, output, verbose)
        return
    if case is not None:
        raise IdentifyError("--case: expected a file of milled slots beside it, got none")
    if hold_out:
        raise IdentifyError("--hold-out: expected recordings of a motion to fit, got none")
    if len(files) > 1:
        raise IdentifyError(f"measurements: expected one file of deflections, got {len(files)}")
    table = files[0] if files else None
    start = find_robot(robot)
    described = load_robot(start)
    deviations = (sd_m, sd_rad, sd_n, sd_nm)
    if plan:
        wish = PlanRequest(count, force, down, lowest_m, seed=seed)
        wish = _with_noise(wish, sd_m, sd_n)
        report, target = _plan(described, robot, torque_curve, wish, table, deviations, output)
        print_report(console, report, verbose)
        console.print(f"Plan: {target}  (report: {target.with_suffix('.html')})")
        return
    if table is None:
        raise typer.BadParameter("expected the file of measurements, or --plan, got neither")
    target = fitted_target(output, f"{table.stem}_identified")
    measured = read_measurements(table, len(described.joints))
    options = IdentifyOptions(noise_of(measured, *deviations), torque_curve, loss, tuple(add or ()))
    identification = identified(described, measured, options)
    words = table.name, f"{table.name}, {measured.count} measurements"
    page_parts = deflection_answer, deflection_sections
    warnings = map(sentence, identification.result.warnings)
    write_robot(identification, start, words, target, *page_parts, warnings, verbose)


def _plan(
    robot: Robot,
    name: str,
    torque_curve: str,
    wish: PlanRequest,
    file: Path | None,
    deviations: tuple[float | None, ...],
    output: Path | None,
) -> tuple[ResultReport, Path]:
    """Write a plan of measurements and its page; return what is told of it, and its file."""
    from coupling.cli.identify_kinds import require_replaceable_plan, write_plan
    from coupling.identification.static.measurements import noise_of, read_measurements
    from coupling.identification.static.plan import planned
    from coupling.report.plan_report import plan_report
    from coupling.report.report_file import write_page

    known_measurements: tuple[Measurements, MeasurementNoise] | None = None
    if file is not None:
        measured = read_measurements(file, len(robot.joints))
        if measured.loop is not None:
            raise IdentifyError(
                "--plan: expected a table of single loads, which it plans, got one with a column loop"
            )
        position, rotation, force, moment = deviations
        noise = noise_of(measured, position or wish.position, rotation or 1e-4, force, moment)
        known_measurements = (measured, noise)
    target = output or Path("results", "plan.csv")
    require_replaceable_plan(target)
    make_folder_of(target, IdentifyError)
    plan_result = planned(robot, torque_curve, wish, known_measurements)
    report = plan_report(plan_result, robot, name, str(target))
    write_plan(plan_result, target)
    write_page(target.with_suffix(".html"), report.page, IdentifyError)
    return report, target


def _with_noise(wish: PlanRequest, position: float | None, force: float | None) -> PlanRequest:
    return replace(
        wish,
        position=wish.position if position is None else position,
        force_deviation=wish.force_deviation if force is None else force,
    )


def _require(word: str, known_words: Iterable[str], option: str) -> None:
    if word not in known_words:
        raise IdentifyError(f"{option}: {one_of(known_words, word)}")
