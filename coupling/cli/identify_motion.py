"""The command line: elastic-robot identify, of a robot in motion."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

import typer

from coupling.cli.console import console
from coupling.errors import IdentifyError
from coupling.files.atomic_file import make_folder_of, write_atomically

_REFUSED = 1


@dataclass(frozen=True)
class MotionRequest:
    """What is asked of recordings.

    Attributes:
        files: Recordings to fit.
        hold_out: Recordings to predict.
        bandwidth: Bandwidth of the motors' smoothed motion [Hz].
        leave_out: Whether each term is left out in turn.
        output: Robot file, or None.
    """

    files: Sequence[Path]
    hold_out: Sequence[Path]
    bandwidth: float
    leave_out: bool
    output: Path | None


def identify_from_motion(request: MotionRequest, robot: str) -> None:
    """Identify a robot, a file or a shipped robot's name, from recordings of its motion."""
    from coupling.files.robot_file import find_robot, load_robot
    from coupling.identification.motion.identification import identify_motion
    from coupling.identification.motion.recording import read_recording
    from coupling.identification.motion.results import motion_figures, moved_text
    from coupling.report.motion_report import motion_page, motion_summary
    from coupling.report.terminal import print_sections

    if request.leave_out and not request.hold_out:
        raise IdentifyError("--leave-out: expected --hold-out, which judges the terms, got none")
    start = find_robot(robot)
    described = load_robot(start)
    target = request.output or Path("results", f"{request.files[0].stem}_identified.toml")
    if target.suffix != ".toml":
        raise IdentifyError(f"--output: expected a name that ends in .toml, got {target.name!r}")
    recordings = [read_recording(file, described) for file in request.files]
    held_out = [read_recording(file, described) for file in request.hold_out]
    found = identify_motion(described, recordings, held_out, request.bandwidth, request.leave_out)
    result = motion_figures(found)
    print_sections(console, motion_summary(result))
    names = ", ".join(recording.name for recording in recordings)
    make_folder_of(target, IdentifyError)
    report = target.with_suffix(".html")
    write_atomically(target.with_suffix(".json"), result.text() + "\n", IdentifyError)
    write_atomically(report, motion_page(f"{names}: {described.name}", result), IdentifyError)
    console.print(f"Report: {report}")
    if found.refusal:
        raise typer.Exit(_REFUSED)
    text = moved_text(found, result, start, target, f"motion of {names}")
    write_atomically(target, text, IdentifyError)
    console.print(f"Robot file: {target}")
