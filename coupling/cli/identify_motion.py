"""The command line: elastic-robot identify, of a robot in motion."""

from __future__ import annotations

import shlex
from collections.abc import Sequence
from functools import partial
from pathlib import Path

from coupling.cli.fitted import fitted_target, write_fitted
from coupling.errors import IdentifyError
from coupling.files.robot_file import find_robot, load_robot
from coupling.identification.motion.identification import identify_motion
from coupling.identification.motion.recording import read_recording
from coupling.report.identify_answers import motion_answer
from coupling.report.motion_report import motion_sections
from coupling.report.result_report import ResultReport
from coupling.results.section import warned


def identify_from_motion(
    robot: str,
    files: Sequence[Path],
    hold_out: Sequence[Path],
    bandwidth: float,
    leave_out: bool,
    output: Path | None,
    is_verbose: bool,
) -> None:
    """Identify a robot from recordings of its motion.

    Args:
        bandwidth: Bandwidth of the motors' smoothed motion [Hz].
        leave_out: Whether each term is left out in turn.
        output: Robot file to write; None for one in the folder results.
    """
    if leave_out and not hold_out:
        raise IdentifyError("--leave-out: expected --hold-out, which judges the terms, got none")
    start = find_robot(robot)
    described = load_robot(start)
    target = fitted_target(output, f"{files[0].stem}_identified")
    recordings = [read_recording(file, described) for file in files]
    recordings += [read_recording(file, described, is_held_out=True) for file in hold_out]
    identified = identify_motion(described, recordings, bandwidth, leave_out)
    result = identified.result
    names = ", ".join(file.name for file in files)
    report = ResultReport(
        "identify",
        f"{names}: {described.name}",
        motion_answer(result, shlex.quote(str(target))),
        partial(motion_sections, result),
        warned(result.remarks),
    )

    def text() -> str:
        return identified.text(start, f"motion of {names}", target)

    write_fitted(target, report, result, text, is_verbose)
