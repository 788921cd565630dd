"""The command line: elastic-robot identify, of a robot in motion."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

from coupling.cli.console import console


def identified_from_motion(
    files: Sequence[Path], robot: str, hold_out: Sequence[Path], bandwidth: float, leave_out: bool
) -> None:
    """Identify a robot from recordings of its motion.

    Args:
        files: Recordings to fit.
        robot: Robot file, or a shipped robot's name.
        hold_out: Recordings to predict.
        bandwidth: Of the motors' smoothed motion [Hz].
        leave_out: Whether each term is left out in turn.
    """
    from coupling.files.robot_file import find_robot, load_robot
    from coupling.motion.identification import identify_motion
    from coupling.motion.recording import read_recording
    from coupling.report.motion_page import motion_summary
    from coupling.report.terminal import tell

    start = find_robot(robot)
    described = load_robot(start)
    count = len(described.joints)
    recordings = [read_recording(file, count) for file in files]
    held_out = [read_recording(file, count) for file in hold_out]
    found = identify_motion(described, recordings, held_out, bandwidth, leave_out)
    tell(console, motion_summary(found))
