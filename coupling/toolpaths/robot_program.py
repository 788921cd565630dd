"""A tool path from CAM: the points of a robot program."""

from __future__ import annotations

import math
from dataclasses import replace
from functools import cached_property
from pathlib import Path
from typing import Annotated, Literal

import numpy as np
from pydantic import Field
from scipy.spatial.transform import Rotation

from coupling.errors import CaseError, ProgramError
from coupling.files.toml_file import FilePath, Positive
from coupling.path.frame import Frame
from coupling.programs.languages import read_program
from coupling.programs.program import Pose, ProgramMove, RobotProgram
from coupling.toolpaths.instants import NONE, Corners
from coupling.toolpaths.oriented_points import SAME, OrientedPoints, PathLaw
from coupling.toolpaths.remarks import counted
from coupling.toolpaths.table import ToolPathTable
from coupling.toolpaths.task import Task
from coupling.toolpaths.untilted import UntiltedPath


class ProgramPath(ToolPathTable):
    """Linear moves of a KRL, RAPID or FANUC program, whose base frame is the part frame.

    Keys: file (.src with its .dat, .mod or .ls); feed_m_s where the program sets no speed;
    max_turn_deg_s, largest rate at which the tool turns; corner_deg, blend_s, sample_s as for G-code.
    """

    kind: Literal["program"]
    file: FilePath
    feed_m_s: Positive | None = None
    corner_deg: Annotated[float, Field(ge=0.0, le=90.0)] = 10.0
    max_turn_deg_s: Positive = 180.0
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
        law = PathLaw(
            float(np.deg2rad(self.corner_deg)),
            self.blend_s,
            float(np.deg2rad(self.max_turn_deg_s)),
            self.sample_s,
        )
        points = _points(self.file, self._program.moves, self.feed_m_s)
        return self._headed(points.untilted(part, law, self.file, corners))


def _points(file: Path, moves: tuple[ProgramMove, ...], feed: float | None) -> OrientedPoints:
    """Return start and targets of the linear moves; a way to the start by joints is left out."""
    targets: list[Pose] = []
    feeds: list[float] = []
    linear = [number for number, move in enumerate(moves, start=1) if move.motion == "linear"]
    for number, move in enumerate(moves, start=1):
        where = move.where or f"{file.name}: motion {number}"
        if move.motion == "linear" and move.pose is not None:
            speed = move.speed or feed
            if targets and speed is None:
                raise CaseError(
                    f"{where}: expected a speed, or feed_m_s in [tool_path], got neither"
                )
            if not targets or not _is_same(move.pose, targets[-1]):
                targets.append(move.pose)
                feeds.append(speed or 0.0)
        elif move.motion == "joint" and len(targets) < 2:
            targets, feeds = ([], []) if move.pose is None else ([move.pose], [0.0])
        elif move.motion == "joint" and number > linear[-1]:
            break  # the way back
        else:
            raise CaseError(f"{where}: expected linear moves to poses, got a {move.motion} one")
    if len(targets) < 2:
        raise CaseError(f"{file}: expected linear moves from one point to another, got none")
    poses = np.array(targets)
    return OrientedPoints(poses[:, :3], Rotation.from_quat(poses[:, 3:]), np.array(feeds))


def _is_same(pose: Pose, other: Pose) -> bool:
    """Return whether poses are one, in place and rotation."""
    if math.dist(pose[:3], other[:3]) > SAME:
        return False
    # The chord between unit quaternions is half the angle between their rotations.
    return min(math.dist(pose[3:], [sign * q for q in other[3:]]) for sign in (1, -1)) < 0.5 * SAME
