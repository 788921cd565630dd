"""Whether a run can become a program: its robot, its command, and what its drives can do."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

import numpy as np

from coupling.case.case import Case, PlacedRobot
from coupling.errors import ProgramError
from coupling.inverse.joint_limits import JointLimits
from coupling.path.histories import ToolPath
from coupling.path.joint_path import JointPath
from coupling.path.length_text import format_um
from coupling.programs.languages import Language
from coupling.results.drive_result import DriveMotion
from coupling.robot.inverse_kinematics import InverseKinematics
from coupling.run.drive_motion import drive_motions
from coupling.run.stored_run import StoredRobot, StoredRun

# By how much a limit may be passed for rounding.
_LIMIT_ROUNDING = 1e-6
# Rounding of poses in command.csv [m], and of those in a table of anybody's [m], [rad].
_COMMAND_ROUNDING, _TABLE_ROUNDING = 1e-9, 1e-5
# Rate of a joint that rests [rad/s]: a run's last row may lie a little behind its end.
_REST_RATE = 1e-2


def require_limits(command: JointPath, limits: JointLimits, who: str) -> tuple[DriveMotion, ...]:
    """Return what a command asks of the drives, all of which they can do.

    Raises:
        ProgramError: With joint, instant, limit and what is asked for.
    """
    motions = drive_motions(command, limits)
    for problem in _problems(motions, limits):
        raise ProgramError(f"{who}{problem}: nothing was written")
    return motions


def _problems(motions: Sequence[DriveMotion], limits: JointLimits) -> list[str]:
    problems = []
    for i, drive in enumerate(motions):
        low, high = limits.lower[i], limits.upper[i]
        lowest, highest = drive.range_rad
        if lowest < low - _LIMIT_ROUNDING or highest > high + _LIMIT_ROUNDING:
            angles = np.rad2deg([low, high, lowest, highest])
            problems.append(
                f"joint {drive.joint}: expected angles of {angles[0]:.2f} to {angles[1]:.2f} deg, got"
                f" {angles[2]:.2f} to {angles[3]:.2f} deg"
            )
        for reached, at, most, unit in (
            (drive.rate_rad_s, drive.rate_time_s, drive.rate_limit_rad_s, "rad/s"),
            (
                *(drive.acceleration_rad_s2, drive.acceleration_time_s),
                *(drive.acceleration_limit_rad_s2, "rad/s^2"),
            ),
        ):
            if most is not None and reached > most * (1.0 + _LIMIT_ROUNDING):
                problems.append(
                    f"joint {drive.joint}: expected at most {most:.4g} {unit}, got {reached:.4g} {unit}"
                    f" at {at:.3f} s"
                )
    return problems


def remark_on(stored: StoredRobot) -> str:
    """Return what is to be known of a run's command, empty where it is as it should be."""
    if stored.figures.kind == "couple":
        return "the run is coupled, not compensated: its command is not corrected"
    if not stored.figures.converged:
        return f"the run has not converged: {stored.figures.reason}"
    return ""


def remark_on_ends(joints: JointPath) -> str:
    """Return where a command moves at its ends, where a program rests; empty where it does not."""
    for what, row in (("begins", 0), ("ends", -1)):
        rates = np.abs(joints.qd[0][row]) if joints.qd else np.zeros(1)
        if rates.max() > _REST_RATE:
            return (
                f"the command {what} with joint {rates.argmax() + 1} at {rates.max():.3g} rad/s, its"
                " program at rest"
            )
    return ""


def require_robots(folder: Path, case: Case, run: StoredRun) -> None:
    """Refuse a run folder whose tables are not of the robots of its case."""
    for placed in case.robots:
        count = len(placed.description.joints)
        stored = run.robots.get(placed.name)
        robots = 0 if stored is None else stored.joints.q[0].shape[1]
        if robots != count:
            raise ProgramError(
                f"{folder}: expected a command of {count} joints for the {placed.name} robot of"
                f" case.toml, got one of {robots}"
            )


def require_same_robot(folder: Path, placed: PlacedRobot, stored: StoredRobot) -> None:
    """Refuse a run whose robot file has been changed since."""
    apart = float(_follow_undeflected(placed, stored.joints).distance_to(stored.command).max())
    if apart > _COMMAND_ROUNDING:
        raise ProgramError(
            f"{folder / 'command.csv'}: expected the poses of the robot file, got a difference of up to"
            f" {format_um(apart)} um: the file has changed since the run, repeat it"
        )


def require_poses(
    file: Path, placed: PlacedRobot, joints: JointPath, poses: ToolPath | None
) -> None:
    """Refuse a table whose poses are not those of its angles: it is another robot's."""
    if poses is None:
        return
    # Times of the table may have been moved by their rounding.
    path = ToolPath(joints.time, poses.pose)
    off = _follow_undeflected(placed, joints).deviation_from(path)[0]
    apart = np.linalg.norm(off[:, :3], axis=1).max()
    rotation = np.linalg.norm(off[:, 3:], axis=1).max()
    if apart > _TABLE_ROUNDING or rotation > _TABLE_ROUNDING:
        raise ProgramError(
            f"{file}: expected the poses of the robot at q1.., got a difference of up to"
            f" {format_um(apart)} um and {1e3 * rotation:.3g} mrad: it is the command of another robot,"
            " tool or base, or only its angles were edited: remove the columns of the poses"
        )


def _follow_undeflected(placed: PlacedRobot, joints: JointPath) -> ToolPath:
    """Return the path of a robot's undeflected tool at the rows of a command, in the world."""
    planner = InverseKinematics(placed.description, placed.home)
    return planner.forward(joints, joints.time).transformed(placed.world_from_base)


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
