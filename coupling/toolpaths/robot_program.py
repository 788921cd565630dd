"""A tool path from CAM: the points of a robot program."""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import cached_property
from pathlib import Path
from typing import Annotated, Literal

import numpy as np
from pydantic import Field
from scipy.spatial.transform import Rotation, Slerp

from coupling.errors import CaseError, ProgramError
from coupling.files.toml_file import FilePath, Positive
from coupling.path.frame import Frame
from coupling.path.histories import ToolPath, poses
from coupling.path.linear import arc_length, interpolated
from coupling.programs.languages import read_program
from coupling.programs.program import Pose, ProgramMove, RobotProgram
from coupling.toolpaths.instants import NONE, Corners, PathTimes
from coupling.toolpaths.motion import Motion, Segment, drive, require_few
from coupling.toolpaths.remarks import counted
from coupling.toolpaths.table import ToolPathTable
from coupling.toolpaths.task import Task
from coupling.toolpaths.untilted import UntiltedPath

# Points this close are one [m].
_ONE = 1e-9


class ProgramPath(ToolPathTable):
    """Linear moves of a KRL, RAPID or FANUC program, whose base frame is the part frame.

    Keys: file (.src with its .dat, .mod or .ls); feed_m_s where the program sets no speed; corner_deg,
    blend_s, sample_s as for G-code.
    """

    kind: Literal["program"]
    file: FilePath
    feed_m_s: Positive | None = None
    corner_deg: Annotated[float, Field(ge=0.0, le=90.0)] = 10.0
    blend_s: Positive = 0.2
    sample_s: Annotated[float, Field(ge=1e-5)] = 0.02

    @cached_property
    def _program(self) -> RobotProgram:
        try:
            return read_program(self.file)
        except ProgramError as cause:
            raise CaseError(str(cause)) from cause

    def task(
        self, part: Frame, corners: Corners = NONE, untilted: UntiltedPath | None = None
    ) -> Task:
        """Return the task, with remarks on statements left out and on what was assumed."""
        name, program = self.file.name, self._program
        remarks = [f"{name}: {sentence}" for sentence in program.assumptions]
        if program.left_out:
            remarks.append(f"{name}: read and left out: {counted(dict(program.left_out))}")
        return replace(super().task(part, corners, untilted), remarks=tuple(remarks))

    def untilted(self, part: Frame, corners: Corners = NONE) -> UntiltedPath:
        """Return the tool path in the world before the tool is turned.

        Raises:
            CaseError: If the program cannot be read, or has motions that are not linear on its way.
        """
        stretches = self._stretches(_points(self.file, self._program.moves, self.feed_m_s))
        count = sum(own.length / own.feed + 2.0 * self.blend_s for own in stretches)
        require_few(count / self.sample_s, self.file)
        motion = Motion([drive(own.segment(), own.feed, self.blend_s) for own in stretches])
        instants = PathTimes.of(motion.ends, self.sample_s, corners)
        moved = motion.at(instants.time)
        stretch = np.searchsorted(motion.ends, instants.time).clip(max=len(stretches) - 1)
        turned = Rotation.concatenate(
            [
                own.rotations(moved[stretch == k, 3])
                for k, own in enumerate(stretches)
                if np.any(stretch == k)
            ]
        )
        path = ToolPath(instants.time, poses(moved[:, :3], turned)).transformed(part)
        return self._of_file(part, path, instants.sample_rows)

    def _stretches(self, points: list[_Point]) -> list[_Stretch]:
        """Return the stretches driven without a rest: at one speed, without a corner."""
        smooth, found = np.cos(np.deg2rad(self.corner_deg)), [[points[0], points[1]]]
        for point in points[2:]:
            (a, b), c = found[-1][-2:], point
            before, behind = b.position - a.position, c.position - b.position
            turn = before @ behind / (np.linalg.norm(before) * np.linalg.norm(behind))
            if c.feed == b.feed and turn >= smooth:
                found[-1].append(c)
            else:
                found.append([b, c])
        return [_Stretch(tuple(own)) for own in found]


@dataclass(frozen=True)
class _Point:
    """A target: position [m], rotation, and the speed to it [m/s]."""

    position: np.ndarray
    rotation: Rotation
    feed: float


@dataclass(frozen=True)
class _Stretch:
    """Points that are joined by lines at one speed."""

    points: tuple[_Point, ...]

    @property
    def feed(self) -> float:
        return self.points[-1].feed

    @property
    def _position(self) -> np.ndarray:
        return np.array([point.position for point in self.points])

    @property
    def _arc(self) -> np.ndarray:
        return arc_length(self._position)

    @property
    def length(self) -> float:
        return float(self._arc[-1])

    def segment(self) -> Segment:
        """Return it as a curve of x, y, z and arc length."""
        arc, position = self._arc, self._position

        def point(s: np.ndarray) -> np.ndarray:
            return np.column_stack([interpolated(s, arc, position), s])

        return Segment(float(arc[-1]), point)

    def rotations(self, s: np.ndarray) -> Rotation:
        """Return the rotations at arc lengths: even about one axis from point to point."""
        knots = Rotation.concatenate([point.rotation for point in self.points])
        found: Rotation = Slerp(self._arc, knots)(np.clip(s, 0.0, self._arc[-1]))
        return found


def _points(file: Path, moves: tuple[ProgramMove, ...], feed: float | None) -> list[_Point]:
    """Return start and targets of the linear moves; a way to the start by joints is left out."""
    points: list[_Point] = []
    for number, move in enumerate(moves, start=1):
        where = move.where or f"{file.name}: motion {number}"
        if move.motion == "linear" and move.pose is not None:
            speed = move.speed or feed
            if points and speed is None:
                raise CaseError(
                    f"{where}: expected a speed, or feed_m_s in [tool_path], got neither"
                )
            points += _new(points, move.pose, speed or 0.0, where)
        elif move.motion == "joint" and len(points) < 2:
            points = [] if move.pose is None else _new([], move.pose, 0.0, where)
        elif move.motion == "joint" and not any(m.motion == "linear" for m in moves[number:]):
            break  # the way back
        else:
            raise CaseError(f"{where}: expected linear moves to poses, got a {move.motion} one")
    if len(points) < 2:
        raise CaseError(f"{file}: expected linear moves from one point to another, got none")
    return points


def _new(points: list[_Point], pose: Pose, feed: float, where: str) -> list[_Point]:
    point = _Point(np.array(pose[:3]), Rotation.from_quat(pose[3:]), feed)
    if not points or np.linalg.norm(point.position - points[-1].position) > _ONE:
        return [point]
    if (point.rotation * points[-1].rotation.inv()).magnitude() > _ONE:
        raise CaseError(f"{where}: expected a way to the next point, got a turn in place")
    return []
