"""A tool path from CAM: the points of a robot program."""

from __future__ import annotations

import math
from dataclasses import replace
from functools import cached_property
from pathlib import Path
from typing import Literal

import numpy as np
from scipy.spatial.transform import Rotation

from coupling.errors import CaseError, ProgramError
from coupling.files.toml_file import Positive
from coupling.path.frame import Frame
from coupling.programs.program import Pose, ProgramMove, RobotProgram, rest_behind
from coupling.toolpaths.cam_path import CamPath
from coupling.toolpaths.instants import NO_CORNERS, Corners
from coupling.toolpaths.oriented_points import POINT_TOLERANCE, OrientedPoints
from coupling.toolpaths.task import Task
from coupling.toolpaths.untilted import UntiltedPath

_MAX_SPEED = 10.0  # no robot goes faster [m/s]
# Rotations from the axes of the program's tool to those of the TCP, whose x axis points along the tool.
_PROGRAM_TOOL_FROM_TCP = {
    "x": Rotation.identity(),
    "z": Rotation.from_euler("y", -90.0, degrees=True),
}
# A part is elsewhere than a program's base from this distance and angle on [m, rad].
_ELSEWHERE = 1e-4
# Programs of makers whose tools usually have z along them.
_Z_USUAL = (".mod", ".modx", ".prg", ".ls")


class ProgramPath(CamPath):
    """Lines and arcs of a KRL, RAPID or FANUC program, whose base frame is the part frame.

    Keys: file (.src with its .dat, .mod or .ls); feed_m_s where the program sets neither speed nor time;
    rapid_m_s, speed of straight ways to the poses of joint motions between lines, which are refused
    without; approach, axis of the program's tool that points along it, as the x axis of the TCP does;
    max_turn_deg_s, largest rate at which the tool turns; corner_deg, blend_s, sample_s as for G-code.
    """

    kind: Literal["program"]
    feed_m_s: Positive | None = None
    rapid_m_s: Positive | None = None
    approach: Literal["x", "z"] | None = None

    @cached_property
    def _program(self) -> RobotProgram:
        try:
            from coupling.programs.languages import read_program

            program = read_program(self.file)
        except ProgramError as cause:
            raise CaseError(str(cause)) from cause
        if self.approach is None and self.file.suffix.lower() in _Z_USUAL:
            said = (
                "the x axis of its tool points along it; where that is z, as is usual for ABB and FANUC,"
                ' write approach = "z" in [tool_path], and otherwise "x"'
            )
            program = replace(program, assumptions=(*program.assumptions, said))
        return program if self.rapid_m_s is None else _with_straight_ways(program, self.rapid_m_s)

    def task(
        self, part: Frame, corners: Corners = NO_CORNERS, untilted: UntiltedPath | None = None
    ) -> Task:
        """Return the task, with a remark where the program itself has its poses elsewhere."""
        task, base = super().task(part, corners, untilted), self._program.base
        if base is None or _is_same(base, part.pose, _ELSEWHERE):
            return task
        x, y, z = (round(value, 6) + 0.0 for value in base[:3])
        roll, pitch, yaw = np.round(Rotation.from_quat(base[3:]).as_euler("xyz", degrees=True), 4)
        said = (
            f"{self.file.name}: its poses are in [part], which is not where the program has its base:"
            f" position_m = [{x:g}, {y:g}, {z:g}], rpy_deg = [{roll:g}, {pitch:g}, {yaw:g}] from the"
            " robot's as the controller counts"
        )
        return replace(task, remarks=(*task.remarks, said))

    def _plan(self) -> OrientedPoints:
        points = _points(self.file, self._program.moves, self.feed_m_s)
        turn = _PROGRAM_TOOL_FROM_TCP[self.approach or "x"]
        return replace(points, rotation=points.rotation * turn)


def _with_straight_ways(program: RobotProgram, speed: float) -> RobotProgram:
    """Return a program whose joint motions to poses, between its first line and its last, are straight.

    The tool rests at both ends of each.
    """
    ways, count = list(program.moves), 0
    lines = [number for number, move in enumerate(ways) if move.motion == "linear"]
    for number in range(lines[0] + 1, lines[-1]) if lines else ():
        move = ways[number]
        if move.motion == "joint" and move.pose is not None:
            ways[number] = replace(move, motion="linear", speed=speed, duration=None, is_stop=True)
            ways[number - 1] = replace(ways[number - 1], is_stop=True)
            count += 1
    said = (
        f"{count} joint motions between lines go straight to their poses, as rapid_m_s says; the"
        " robot's own go another way"
    )
    assumptions = (*program.assumptions, said) if count else program.assumptions
    return replace(program, moves=tuple(ways), assumptions=assumptions)


def _points(file: Path, moves: tuple[ProgramMove, ...], feed: float | None) -> OrientedPoints:
    """Return start and targets of the linear moves; a way to the start by joints is left out."""
    targets: list[Pose] = []
    passing: list[ProgramMove] = []
    linear = [number for number, move in enumerate(moves, start=1) if move.motion == "linear"]
    for number, move in enumerate(moves, start=1):
        where = move.where or f"{file.name}: motion {number}"
        if move.motion == "linear" and move.pose is not None:
            speed = move.speed or feed
            if speed is not None and speed > _MAX_SPEED:
                raise CaseError(
                    f"{where}: expected at most {_MAX_SPEED:g} m/s, got {speed:.4g} m/s: look at its"
                    " unit, m/s in KRL, mm/s in RAPID"
                )
            if targets and speed is None and move.duration is None:
                raise CaseError(
                    f"{where}: expected a speed, a time, or feed_m_s in [tool_path], got none"
                )
            if not targets or not _is_same(move.pose, targets[-1]):
                targets.append(move.pose)
                passing.append(move)
            elif move.is_stop:
                rest_behind(passing, move.wait)
        elif move.motion == "joint" and len(targets) < 2:
            targets, passing = ([], []) if move.pose is None else ([move.pose], [move])
        elif move.motion == "joint" and number > linear[-1]:
            break  # the way back
        else:
            remedy = ""
            if move.motion == "joint":
                remedy = ": give rapid_m_s in [tool_path], and the tool goes straight to its pose"
                if move.pose is None:
                    remedy = ", to joint angles: write a line to its pose"
            raise CaseError(
                f"{where}: expected linear moves to poses, got a {move.motion} one{remedy}"
            )
    if len(targets) < 2:
        raise CaseError(f"{file}: expected linear moves from one point to another, got none")
    poses = np.array(targets)
    return OrientedPoints(
        poses[:, :3],
        Rotation.from_quat(poses[:, 3:]),
        np.array([move.speed or feed or 0.0 for move in passing]),
        np.array([move.is_stop for move in passing]),
        np.array([move.wait for move in passing[1:]]),
        np.array([move.duration or math.nan for move in passing]),
    )


def _is_same(pose: Pose, other: Pose, tolerance: float = POINT_TOLERANCE) -> bool:
    """Return whether poses are one, in place and rotation, but for a distance [m] and an angle [rad]."""
    if math.dist(pose[:3], other[:3]) > tolerance:
        return False
    # The chord between unit quaternions is half the angle between their rotations.
    return (
        min(math.dist(pose[3:], [sign * q for q in other[3:]]) for sign in (1, -1))
        < 0.5 * tolerance
    )
