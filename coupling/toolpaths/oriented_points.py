"""Paths through points at which the tool has an orientation each."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np
from scipy.spatial.transform import Rotation, Slerp

from coupling.path.frame import Frame
from coupling.path.histories import ToolPath, poses
from coupling.path.linear import interpolated
from coupling.toolpaths.instants import NONE, Corners, PathTimes
from coupling.toolpaths.motion import require_few
from coupling.toolpaths.travel import Travel
from coupling.toolpaths.untilted import UntiltedPath

# Points this close are one [m], and rotations [rad].
SAME = 1e-9


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
        waits: How long it rests there [s], (n,); None: not at all.
    """

    position: np.ndarray
    rotation: Rotation
    feed: np.ndarray
    rests: np.ndarray | None = None
    waits: np.ndarray | None = None

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
        return np.where(self._lengths > SAME, self._lengths, self._turns)

    def travel(self, law: PathLaw) -> Travel:
        """Return the motion along the ways of points."""
        stays = self._lengths <= SAME
        rate = np.where(stays, law.fastest_turn, self.feed[1:])
        fastest = np.divide(
            law.fastest_turn * self._ways, self._turns, out=rate.copy(), where=self._turns > SAME
        )
        along = np.einsum("ij,ij->i", self._steps[1:], self._steps[:-1])
        straight = np.cos(law.corner) * self._lengths[1:] * self._lengths[:-1]
        stops = np.append((along < straight) | stays[1:] | stays[:-1], True)
        if self.rests is not None:
            stops |= self.rests[1:]
        waits = None if self.waits is None else self.waits[1:]
        return Travel.along(self._ways, np.minimum(rate, fastest), law.blend, stops, waits)

    def at(self, way: np.ndarray) -> tuple[np.ndarray, Rotation]:
        """Return points [m], (k, 3), and rotations at ways from the first point on, (k,)."""
        knots = np.append(0.0, np.cumsum(self._ways))
        points = interpolated(way, knots, self.position)
        return points, Slerp(knots, self.rotation)(np.clip(way, 0.0, knots[-1]))

    def untilted(
        self, part: Frame, law: PathLaw, where: object, corners: Corners = NONE
    ) -> UntiltedPath:
        """Return the path of a tool that goes to the points.

        Args:
            part: base_from_part.
            law: How they are passed.
            where: What an error is about.
            corners: Times at which the process is to be evaluated as well [s].

        Raises:
            CaseError: If it takes too long.
        """
        travel = self.travel(law)
        require_few(float(travel.rests[-1]) / law.sample, where)
        instants = PathTimes.of(travel.rests, law.sample, corners)
        path = ToolPath(instants.time, poses(*self.at(travel.at(instants.time))))
        return UntiltedPath(part, path.transformed(part), instants.sample_rows)
