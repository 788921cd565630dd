"""The command line: elastic-robot identify, of a robot in motion."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

from coupling.cli.fitted import robot_target, write_findings, write_robot
from coupling.errors import IdentifyError
from coupling.files.robot_file import find_robot, load_robot
from coupling.identification.motion.identification import identify_motion
from coupling.identification.motion.recording import read_recording
from coupling.identification.motion.results import motion_figures, motion_text
from coupling.report.motion_report import motion_page, motion_summary


def identify_from_motion(
    robot: str,
    files: Sequence[Path],
    hold_out: Sequence[Path],
    bandwidth: float,
    leave_out: bool,
    output: Path | None,
) -> None:
    """Identify a robot from recordings of its motion.

    Args:
        robot: Robot file, or name of a shipped robot.
        files: Recordings to fit.
        hold_out: Recordings to predict.
        bandwidth: Bandwidth of the motors' smoothed motion [Hz].
        leave_out: Whether each term is left out in turn.
        output: Robot file to write; None for one in the folder results.
    """
    if leave_out and not hold_out:
        raise IdentifyError("--leave-out: expected --hold-out, which judges the terms, got none")
    start = find_robot(robot)
    described = load_robot(start)
    target = robot_target(output, f"{files[0].stem}_identified", IdentifyError)
    recordings = [read_recording(file, described) for file in files]
    held_out = [read_recording(file, described) for file in hold_out]
    motion_result = identify_motion(described, recordings, held_out, bandwidth, leave_out)
    result = motion_figures(motion_result)
    names = ", ".join(recording.name for recording in recordings)
    page = motion_page(f"{names}: {described.name}", result)
    write_findings(target, result, motion_summary(result), page, IdentifyError)
    text = motion_text(motion_result, result, start, target, f"motion of {names}")
    write_robot(target, text, IdentifyError)
