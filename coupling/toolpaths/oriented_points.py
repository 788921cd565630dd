"""Paths through points at which the tool has an orientation each."""

from __future__ import annotations

from abc import abstractmethod
from dataclasses import dataclass, replace
from functools import cached_property
from typing import Annotated

import numpy as np
from pydantic import Field
from scipy.spatial.transform import Rotation, Slerp

from coupling.files.toml_file import FilePath, Positive
from coupling.path.frame import Frame
from coupling.path.histories import ToolPath, poses
from coupling.path.linear import interpolate_rows
from coupling.toolpaths.instants import NO_CORNERS, Corners, PathTimes
from coupling.toolpaths.motion import require_few
from coupling.toolpaths.spindle import ProgrammedSpindle
from coupling.toolpaths.table import ToolPathTable
from coupling.toolpaths.task import Task
from coupling.toolpaths.travel import Travel
from coupling.toolpaths.untilted import UntiltedPath

# Points this close are one [m], and rotations [rad].
POINT_TOLERANCE = 1e-9
# A jump of the angular velocity that is not worth a remark [deg/s].
TURN_JUMP = 1.0


@dataclass(frozen=True)
class PathLaw:
    """How points are passed.

    Attributes:
        corner: Change of direction from which on the tool rests [rad].
        blend: Duration of a start or stop [s].
        fastest_turn: Largest rate at which the tool turns [rad/s].
        sample: Longest time between two samples [s].
    """

    corner: float
    blend: float
    fastest_turn: float
    sample: float


@dataclass(frozen=True)
class OrientedPoints:
    """Points in the part frame that a tool goes to one after the other.

    Between two points its tip goes straight, and the tool turns evenly with the way, about one axis.
    The feed is that of the tip; it is lower where the tool would turn faster than it may.  Where the
    tip stays, the tool rests, turns, and rests.

    Attributes:
        position: The points [m], (n, 3), n >= 2; none is its predecessor in place and rotation.
        rotation: Rotations part_from_tool at them, (n,).
        feed: Speeds to each [m/s], (n,); the first one is not used.
        rests: Whether the tool rests at each, beside corners [1], (n,); None: nowhere.
        waits: Durations of its rests there [s], (n,); None: zeros.
        duration: Times of the ways to each [s], (n,), which count instead of the feed, NaN where the
            feed counts; None: it does everywhere.  Starts and stops take longer.
    """

    position: np.ndarray
    rotation: Rotation
    feed: np.ndarray
    rests: np.ndarray | None = None
    waits: np.ndarray | None = None
    duration: np.ndarray | None = None

    @cached_property
    def _steps(self) -> np.ndarray:
        return np.diff(self.position, axis=0)

    @cached_property
    def _lengths(self) -> np.ndarray:
        lengths: np.ndarray = np.linalg.norm(self._steps, axis=1)
        return lengths

    @cached_property
    def _turns(self) -> np.ndarray:
        """Angles from point to point [rad], (n - 1,)."""
        turns: np.ndarray = (self.rotation[1:] * self.rotation[:-1].inv()).magnitude()
        return turns

    @cached_property
    def _ways(self) -> np.ndarray:
        """Ways from point to point, (n - 1,): lengths [m], or angles [rad] where the tip stays."""
        return np.where(self._lengths > POINT_TOLERANCE, self._lengths, self._turns)

    def travel(self, law: PathLaw) -> Travel:
        """Return the motion along the ways of points."""
        speed, stops = self._speeds(law)
        waits = None if self.waits is None else self.waits[1:]
        return Travel.along(self._ways, speed, law.blend, stops, waits)

    def turn_jump(self, law: PathLaw) -> float:
        """Return by how much the angular velocity of the tool jumps at a point at most [rad/s].

        Along the moves the tool turns by vectors phi in ways L; where two of them meet at a speed v
        without a rest, it is v |phi_1/L_1 - phi_2/L_2|.
        """
        speed, stops = self._speeds(law)
        turns = (self.rotation[1:] * self.rotation[:-1].inv()).as_rotvec() / self._ways[:, None]
        jumps = np.minimum(speed[1:], speed[:-1]) * np.linalg.norm(np.diff(turns, axis=0), axis=1)
        return float(np.max(jumps, initial=0.0, where=~stops[:-1]))

    def _speeds(self, law: PathLaw) -> tuple[np.ndarray, np.ndarray]:
        """Return largest speeds to the points [m/s or rad/s], and whether the tool rests there."""
        stays = self._lengths <= POINT_TOLERANCE
        rate = np.where(stays, law.fastest_turn, self.feed[1:])
        if self.duration is not None:
            times = self.duration[1:]
            rate = np.divide(self._ways, times, out=rate, where=np.isfinite(times))
        fastest = np.divide(
            law.fastest_turn * self._ways,
            self._turns,
            out=rate.copy(),
            where=self._turns > POINT_TOLERANCE,
        )
        along = np.einsum("ij,ij->i", self._steps[1:], self._steps[:-1])
        straight = np.cos(law.corner) * self._lengths[1:] * self._lengths[:-1]
        stops = np.append((along < straight) | stays[1:] | stays[:-1], True)
        if self.rests is not None:
            stops |= self.rests[1:]
        return np.minimum(rate, fastest), stops

    def at(self, way: np.ndarray) -> tuple[np.ndarray, Rotation]:
        """Return points [m], (k, 3), and rotations at ways from the first point on, (k,)."""
        knots = np.append(0.0, np.cumsum(self._ways))
        points = interpolate_rows(way, knots, self.position)
        return points, Slerp(knots, self.rotation)(np.clip(way, 0.0, knots[-1]))

    def untilted(
        self, part: Frame, law: PathLaw, where: object, corners: Corners = NO_CORNERS
    ) -> UntiltedPath:
        """Return the path of a tool that goes to the points.

        Args:
            part: base_from_part.
            law: Law by which they are passed.
            where: File that an error is about.
            corners: Times at which the process is to be evaluated as well [s].

        Raises:
            CaseError: If it takes too long.
        """
        travel = self.travel(law)
        require_few(float(travel.rests[-1]) / law.sample, where)
        instants = PathTimes.of(travel.rests, law.sample, corners)
        path = ToolPath(instants.time, poses(*self.at(travel.at(instants.time))))
        return UntiltedPath(part, path.transformed(part), instants.sample_rows)


class OrientedPath(ToolPathTable):
    """A tool path through points of a file.

    Keys: file; corner_deg, the change of direction from which on the tool rests; max_turn_deg_s, largest
    rate at which it turns; blend_s of starts and stops, sample_s.
    """

    file: FilePath
    corner_deg: Annotated[float, Field(ge=0.0, le=90.0)] = 10.0
    max_turn_deg_s: Positive = 180.0
    blend_s: Positive = 0.2
    sample_s: Annotated[float, Field(ge=1e-5)] = 0.02

    @abstractmethod
    def _read_points(self) -> OrientedPoints:
        """Return the points of the file."""

    @abstractmethod
    def _read_remarks(self) -> list[str]:
        """Return what was left out of the file, and assumed."""

    def _read_spindle(self) -> ProgrammedSpindle | None:
        """Return the spindle's speeds; None where the file says nothing of them."""
        return None

    @cached_property
    def _points(self) -> OrientedPoints:
        return self._read_points()

    @property
    def _law(self) -> PathLaw:
        corner, fastest = np.deg2rad([self.corner_deg, self.max_turn_deg_s]).tolist()
        return PathLaw(corner, self.blend_s, fastest, self.sample_s)

    def task(
        self, part: Frame, corners: Corners = NO_CORNERS, untilted: UntiltedPath | None = None
    ) -> Task:
        """Return the task, with remarks on the file and on jumps of the angular velocity."""
        remarks = self._read_remarks()
        if (jump := np.rad2deg(self._points.turn_jump(self._law))) > TURN_JUMP:
            remarks.append(
                "where points are passed without a rest, the tool's angular velocity jumps, by up to"
                f" {jump:.3g} deg/s"
            )
        named_remarks = tuple(f"{self.file.name}: {remark}" for remark in remarks)
        task = super().task(part, corners, untilted)
        return replace(task, remarks=named_remarks, spindle=self._read_spindle())

    def untilted(self, part: Frame, corners: Corners = NO_CORNERS) -> UntiltedPath:
        """Return the tool path in the world before the tool is turned.

        Raises:
            CaseError: If the file is unreadable or not such a path, or takes too long.
        """
        return self._with_headings(self._points.untilted(part, self._law, self.file, corners))
