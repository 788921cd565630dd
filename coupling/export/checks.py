"""Whether a run can become a program: its robot, its command, and what its drives can do."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

import numpy as np

from coupling.case import Case
from coupling.errors import ProgramError
from coupling.inverse.joint_limits import JointLimits
from coupling.path.histories import JointPath
from coupling.programs.languages import Language
from coupling.robot.cell import Member
from coupling.run.drive_motion import DriveMotion, drive_motions
from coupling.run.stored_run import StoredRobot, StoredRun

# By how much a limit may be passed for rounding.
_ROUNDING = 1e-6
# Rounding of poses in command.csv [m].
_SAME = 1e-9


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


def remark_on(stored: StoredRobot) -> str:
    """Return what is to be known of a run's command, empty where it is as it should be."""
    if stored.figures["kind"] == "couple":
        return "the run is coupled, not compensated: its command is not corrected"
    if not stored.figures.get("converged", True):
        return f"the run has not converged: {stored.figures.get('reason', '')}"
    return ""


def require_robots(folder: Path, case: Case, run: StoredRun) -> None:
    """Refuse a run folder whose tables are not of the robots of its case."""
    for placed in case.robots:
        count = len(placed.description.joints)
        stored = run.robots.get(placed.name)
        found = 0 if stored is None else stored.joints.q[0].shape[1]
        if found != count:
            raise ProgramError(
                f"{folder}: expected a command of {count} joints for the {placed.name} robot of"
                f" case.toml, got one of {found}"
            )


def require_same_robot(folder: Path, member: Member, stored: StoredRobot) -> None:
    """Refuse a run whose robot file has been changed since."""
    own = member.planner.forward(stored.joints, stored.joints.time)
    path = member.placement.path_in_world(own)
    apart = float(path.distance_to(stored.command).max())
    if apart > _SAME:
        raise ProgramError(
            f"{folder / 'command.csv'}: expected the poses of the robot file, got some that are"
            f" {1e6 * apart:.3g} um off: the file has changed since the run, repeat it"
        )


def require_joints(language: Language, joints: int) -> None:
    """Refuse a robot that a language has no words for."""
    if language.joints is not None and joints != language.joints:
        raise ProgramError(
            f"--to: {language.name}: expected a robot of {language.joints} joints, got one of {joints}:"
            " csv takes any number"
        )


def require_step(language: Language, cycle: float) -> None:
    """Refuse a cycle whose multiples a language cannot write."""
    if language.step and abs(cycle / language.step - round(cycle / language.step)) > 1e-6:
        raise ProgramError(
            f"--cycle-ms: {language.name}: expected whole multiples of {1e3 * language.step:g} ms, got"
            f" {1e3 * cycle:g} ms"
        )
