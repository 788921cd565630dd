"""elastic-robot identify, from motion, frequency responses and milled slots, and the table of --plan."""

from __future__ import annotations

import csv
import io
import shlex
from collections.abc import Callable, Iterable, Sequence
from functools import partial
from pathlib import Path

import numpy as np

from coupling.cli.arguments import posture_of
from coupling.cli.fitted import fitted_target, write_fitted
from coupling.errors import IdentifyError
from coupling.files.atomic_file import write_atomically, writing
from coupling.files.output_file import require_output
from coupling.files.robot_file import find_robot, load_robot
from coupling.identification.robot_file import Figures, Fit, Identification
from coupling.identification.static.measurements import FORCE, SHIFT
from coupling.identification.static.plan import MeasurementPlan
from coupling.report.result_report import ResultReport
from coupling.results.section import Answer, Section, warned

_OPTIONS = ("--diameter-mm", "--teeth", "--helix-deg", "--rpm", "--depth-mm")


def write_robot(
    identified: Identification[Fit, Figures],
    start: Path,
    measured: tuple[str, str],
    target: Path,
    answer: Callable[[Figures, str], Answer],
    sections: Callable[[Figures], Sequence[Section]],
    warnings: Iterable[str],
    is_verbose: bool,
) -> None:
    """Write an identified robot with figures and page, and print what is told of it.

    Args:
        start: File of the start.
        measured: Names of the measured files; and kind and source, as the robot file has them.
        target: Robot file to write.
        answer, sections: Functions that return the first screen, of a file by its name, and the rest.
        warnings: Sentences on what the user should look at.

    Raises:
        Exit: If it is refused, with status 1.
    """
    result, (names, source) = identified.result, measured
    report = ResultReport(
        "identify",
        f"{names}: {identified.robot.name}",
        answer(result, shlex.quote(str(target))),
        partial(sections, result),
        warned(warnings),
    )
    text = partial(identified.text, start, source, target)
    write_fitted(target, report, result, text, is_verbose)


def identify_from_motion(
    robot: str,
    files: Sequence[Path],
    hold_out: Sequence[Path],
    bandwidth: float,
    output: Path | None,
    is_verbose: bool,
) -> None:
    """Identify a robot from recordings of its motion.

    Args:
        bandwidth: Bandwidth of the motors' smoothed motion [Hz].
        output: Robot file to write; None for one in the folder results.
    """
    from coupling.identification.motion.identification import identify_motion
    from coupling.identification.motion.recording import read_recording
    from coupling.report.identify_answers import motion_answer
    from coupling.report.motion_report import motion_sections

    start = find_robot(robot)
    described = load_robot(start)
    target = fitted_target(output, f"{files[0].stem}_identified")
    recordings = [read_recording(file, described) for file in files]
    recordings += [read_recording(file, described, is_held_out=True) for file in hold_out]
    identified = identify_motion(described, recordings, bandwidth)
    names, remarks = ", ".join(file.name for file in files), identified.result.remarks
    measured, page_parts = (names, f"motion of {names}"), (motion_answer, motion_sections)
    write_robot(identified, start, measured, target, *page_parts, remarks, is_verbose)


def identify_responses(
    robot: str,
    files: Sequence[Path],
    hold_out: Sequence[Path],
    postures_deg: Sequence[str],
    torque_curve: str,
    output: Path | None,
    is_verbose: bool,
) -> None:
    """Identify stiffness and damping from frequency responses.

    Args:
        postures_deg: Joint angles [deg] of each file, first those to fit, then those to predict.
        output: Robot file to write; None for one in the folder results.
    """
    from coupling.identification.response.identification import identify_from_responses
    from coupling.identification.response.posture import read_posture
    from coupling.report.identify_answers import response_answer
    from coupling.report.response_report import response_sections, response_warnings

    if torque_curve not in ("linear", "backlash"):
        raise IdentifyError(
            f"--torque-curve: expected linear or backlash beside responses, got {torque_curve}"
        )
    count = len(files) + len(hold_out)
    if len(postures_deg) != count:
        raise IdentifyError(
            f"--posture-deg: expected it once for each of {count} files of responses, those held out"
            f" last, got it {len(postures_deg)} times"
        )
    start = find_robot(robot)
    described = load_robot(start)
    joints = len(described.joints)
    angles = [np.deg2rad(posture_of(text, IdentifyError, joints)) for text in postures_deg]
    target = fitted_target(output, f"{files[0].stem}_identified")
    postures = [
        read_posture(file, q, number >= len(files))
        for number, (file, q) in enumerate(zip([*files, *hold_out], angles, strict=True))
    ]
    identified = identify_from_responses(described, torque_curve, postures)
    names, warnings = ", ".join(file.name for file in files), response_warnings(identified.result)
    measured = names, f"frequency responses in {len(files)} postures: {names}"
    page_parts = response_answer, response_sections
    write_robot(identified, start, measured, target, *page_parts, warnings, is_verbose)


def identify_from_cuts(
    file: Path,
    options: tuple[float | None, ...],
    case: Path | None,
    output: Path | None,
    is_verbose: bool,
) -> None:
    """Identify cutting coefficients and run-out from slots under a dynamometer.

    Args:
        options: Diameter [mm], teeth, helix [deg], speed [1/min] and depth [mm].
        case: Milling case that is written anew with what is identified; None for a file of keys alone.
        output: File to write, beside the case if that is given; None for one beside it, or in the
            folder results.
    """
    from coupling.identification.cutting.results import case_text, identify_cutting, keys_text
    from coupling.identification.cutting.slots import MeasuredSlots, SlotCutter
    from coupling.report.cutting_report import cutting_sections
    from coupling.report.identify_answers import cutting_answer

    numbers = [np.nan if value is None else value for value in options]
    if missing := [name for name, value in zip(_OPTIONS, options, strict=True) if value is None]:
        raise IdentifyError(
            f"{file}: {', '.join(missing)}: expected the cutter and the cut of the slots, got none: give"
            " them"
        )
    diameter, teeth, helix, rpm, depth = numbers
    cutter = SlotCutter(1e-3 * diameter, round(teeth), float(np.deg2rad(helix)), rpm, 1e-3 * depth)
    target = fitted_target(_beside(case, output), f"{file.stem}_coefficients")
    slots = MeasuredSlots.read(file, cutter)
    result = identify_cutting(cutter, slots)
    answer = cutting_answer(result, shlex.quote(str(target)), is_case=case is not None)
    keys = keys_text(result, file.name)
    text = keys if case is None else case_text(case, cutter, result, file.name)
    report = ResultReport(
        "identify", f"{file.name}: cutting coefficients", answer, partial(cutting_sections, result)
    )
    write_fitted(target, report, result, lambda: text, is_verbose)


def _beside(case: Path | None, output: Path | None) -> Path | None:
    """Return the file to write: beside a case, whose paths are relative to it."""
    if case is None:
        return output
    target = output or case.with_name(f"{case.stem}_identified.toml")
    if target.resolve().parent != case.resolve().parent:
        raise IdentifyError(
            f"--output: expected a file in {case.resolve().parent}, from where {case.name} names its"
            f" files, got {target}"
        )
    return target


def require_replaceable_plan(file: Path) -> None:
    """Refuse a file that is no plan, a plan into which something was filled in, and another's page."""
    require_output(file, ".csv", IdentifyError)
    require_output(file.with_suffix(".html"), ".html", IdentifyError)
    if not file.is_file():
        return
    with writing(file, IdentifyError):
        rows = file.read_text(encoding="utf-8", errors="replace").splitlines()[2:]
    if not all(row.endswith("," * len(SHIFT)) for row in rows):
        raise IdentifyError(
            f"{file}: holds a plan with measurements: give another name for the new one (--output)"
        )


def write_plan(plan: MeasurementPlan, file: Path) -> None:
    """Write the poses and loads of a plan, with empty cells for what will be measured."""
    planned = plan.measurements
    angles = tuple(f"q{i + 1}" for i in range(planned.q.shape[1]))
    stream = io.StringIO()
    rows = csv.writer(stream, lineterminator="\n")
    stream.write(
        "# Poses and loads to measure, by elastic-robot identify: fill in dx, dy, dz [m], base axes,"
        " loaded less unloaded.\n"
    )
    rows.writerow(("name", *angles, *FORCE, *SHIFT))
    for k in range(planned.count):
        numbers = [*planned.q[k], *planned.wrench[k, :3]]
        rows.writerow([f"pose {k + 1}", *(f"{value:.9g}" for value in numbers), "", "", ""])
    write_atomically(file, stream.getvalue(), IdentifyError)
