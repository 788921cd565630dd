"""Whether a robot can do what its program asks: angles, rates and accelerations of its joints."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from coupling.errors import ProgramError
from coupling.inverse.joint_limits import JointLimits
from coupling.path.histories import JointPath
from coupling.run.drive_motion import DriveMotion, drive_motions

# By how much a limit may be passed for rounding.
_ROUNDING = 1e-6


def require_limits(command: JointPath, limits: JointLimits, who: str) -> tuple[DriveMotion, ...]:
    """Return what a command asks of the drives, all of which they can do.

    Args:
        command: Motion of one robot.
        limits: What its drives can do.
        who: The robot, for messages.

    Raises:
        ProgramError: With joint, instant, limit and what is asked for.
    """
    motions = drive_motions(command, limits)
    for problem in _problems(command, motions, limits):
        raise ProgramError(f"{who}{problem}: nothing was written")
    return motions


def _problems(command: JointPath, motions: Sequence[DriveMotion], limits: JointLimits) -> list[str]:
    found = []
    for i, drive in enumerate(motions):
        low, high = limits.lower[i], limits.upper[i]
        if drive.lowest < low - _ROUNDING or drive.highest > high + _ROUNDING:
            angles = np.rad2deg([low, high, drive.lowest, drive.highest])
            found.append(
                f"joint {drive.joint}: expected angles of {angles[0]:.2f} to {angles[1]:.2f} deg, got"
                f" {angles[2]:.2f} to {angles[3]:.2f} deg"
            )
        for asked, at, most, unit in (
            (drive.rate, drive.rate_time, drive.rate_limit, "rad/s"),
            (drive.acceleration, drive.acceleration_time, drive.acceleration_limit, "rad/s^2"),
        ):
            if most is not None and asked > most * (1.0 + _ROUNDING):
                found.append(
                    f"joint {drive.joint}: expected at most {most:.4g} {unit}, got {asked:.4g} {unit} at"
                    f" {at:.3f} s"
                )
    return found
