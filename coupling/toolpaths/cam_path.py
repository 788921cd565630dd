"""Tool paths from files of CAM: pieces that are passed at their feeds, from rest to rest."""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from typing import Annotated, Protocol

import numpy as np
from pydantic import Field
from scipy.spatial.transform import Rotation

from coupling.errors import CaseError, locate_errors
from coupling.files.toml_file import FilePath, Positive
from coupling.path.frame import Frame
from coupling.path.histories import ToolPath, poses
from coupling.toolpaths.instants import NO_CORNERS, Corners, PathTimes
from coupling.toolpaths.motion import require_few
from coupling.toolpaths.spindle import ProgrammedSpindle
from coupling.toolpaths.table import ToolPathTable
from coupling.toolpaths.task import Task
from coupling.toolpaths.travel import Travel
from coupling.toolpaths.untilted import UntiltedPath

# A jump of the angular velocity that is not worth a remark [deg/s].
_TURN_JUMP = 1.0


@dataclass(frozen=True)
class PassingLaw:
    """How pieces are passed.

    Attributes:
        corner: Change of direction from which on the tool rests [rad].
        fastest_turn: Largest rate at which the tool turns [rad/s].
    """

    corner: float
    fastest_turn: float


class Course(ABC):
    """Pieces of a path joined end to end, n of them.

    Attributes:
        lengths: Their ways: lengths [m], or angles [rad] where the tip stays and the tool turns, (n,).
        waits: Durations of the rests behind each [s], (n,).
    """

    lengths: np.ndarray
    waits: np.ndarray

    @abstractmethod
    def passing(self, law: PassingLaw) -> tuple[np.ndarray, np.ndarray]:
        """Return the speeds of the pieces [m/s or rad/s], and whether the tool rests behind each."""

    @abstractmethod
    def at(self, way: np.ndarray) -> tuple[np.ndarray, Rotation]:
        """Return points [m], (k, 3), and rotations part_from_tool at rising ways, (k,), in the part.

        Raises:
            ValueError: If the tool's rotation about its axis cannot be chosen.
        """

    @abstractmethod
    def turn_jump(self, speeds: np.ndarray, stops: np.ndarray) -> float:
        """Return the largest jump of the tool's angular velocity between pieces [rad/s].

        Args:
            speeds: Speeds of the pieces [m/s or rad/s], (n,).
            stops: Whether the tool rests behind each [1], (n,).
        """

    def acceleration_jump(self, speeds: np.ndarray, stops: np.ndarray) -> float:
        """Return the largest jump of the tip's acceleration there [m/s^2]; arguments as `turn_jump`."""
        return 0.0


class ReadProgram(Protocol):
    """What a reader tells beside the motions."""

    @property
    def left_out(self) -> Mapping[str, int] | Iterable[tuple[str, int]]:
        """Words that were read and left out, by how often they stand there."""

    @property
    def assumptions(self) -> Sequence[str]:
        """Assumptions made, sentences without a full stop."""


class CamPath(ToolPathTable):
    """A tool path along the pieces of a file's program.

    Keys: file; corner_deg, the change of direction from which on the tool rests; max_turn_deg_s, largest
    rate at which it turns; blend_s of starts and stops, sample_s.
    """

    file: FilePath
    corner_deg: Annotated[float, Field(ge=0.0, le=90.0)] = 10.0
    max_turn_deg_s: Positive = 180.0
    blend_s: Positive = 0.2
    sample_s: Annotated[float, Field(ge=1e-5)] = 0.02

    @property
    @abstractmethod
    def _program(self) -> ReadProgram:
        """The program of the file."""

    @abstractmethod
    def _plan(self) -> Course:
        """Return the pieces of the program.

        Raises:
            ValueError: If there are none that a tool can follow.
        """

    def _spindle(self) -> ProgrammedSpindle | None:
        """Return the spindle's speeds; None where the file says nothing of them."""
        return None

    @cached_property
    def _course(self) -> Course:
        with locate_errors(str(self.file), ValueError, CaseError):
            return self._plan()

    @cached_property
    def _passing(self) -> tuple[np.ndarray, np.ndarray]:
        corner, fastest = np.deg2rad([self.corner_deg, self.max_turn_deg_s]).tolist()
        return self._course.passing(PassingLaw(corner, fastest))

    def _remarks(self) -> list[str]:
        """Return sentences on the program, and on jumps where pieces meet."""
        remarks = list(self._program.assumptions)
        if left_out := dict(self._program.left_out):
            words = [f"{word} ({n})" if n > 1 else word for word, n in left_out.items()]
            remarks.insert(0, f"read and left out: {', '.join(words)}")
        if jump := self._course.acceleration_jump(*self._passing):
            remarks.append(
                "where lines and arcs meet without a rest, the acceleration jumps, by up to"
                f" {jump:.3g} m/s^2 at the feed"
            )
        if (jump := np.rad2deg(self._course.turn_jump(*self._passing))) > _TURN_JUMP:
            remarks.append(
                "where moves are passed without a rest, the tool's angular velocity jumps, by up to"
                f" {jump:.3g} deg/s"
            )
        return remarks

    def task(
        self, part: Frame, corners: Corners = NO_CORNERS, untilted: UntiltedPath | None = None
    ) -> Task:
        """Return the task, with remarks on words without effect, assumptions and jumps."""
        remarks = tuple(f"{self.file.name}: {remark}" for remark in self._remarks())
        task = super().task(part, corners, untilted)
        return replace(task, remarks=remarks, spindle=self._spindle())

    def untilted(self, part: Frame, corners: Corners = NO_CORNERS) -> UntiltedPath:
        """Return the tool path in the world before the tool is turned.

        Raises:
            CaseError: If the file is unreadable or not such a program, or takes too long.
        """
        course, (speeds, stops) = self._course, self._passing
        travel = Travel.along(course.lengths, speeds, self.blend_s, stops, course.waits)
        require_few(float(travel.rests[-1]) / self.sample_s, self.file)
        instants = PathTimes.of(travel.rests, self.sample_s, corners)
        with locate_errors(str(self.file), ValueError, CaseError):
            tools = poses(*course.at(travel.at(instants.time)))
        path = ToolPath(instants.time, tools).transformed(part)
        return self._with_headings(UntiltedPath(part, path, instants.sample_rows))
