"""Points at which a tool has an orientation each, as pieces of a path."""

from __future__ import annotations

from dataclasses import dataclass, field
from functools import cached_property

import numpy as np
from scipy.spatial.transform import Rotation, Slerp

from coupling.path.linear import interpolate_rows
from coupling.toolpaths.cam_path import Course, PassingLaw

# Points this close are one [m], and rotations [rad].
POINT_TOLERANCE = 1e-9


@dataclass(frozen=True)
class OrientedPoints(Course):
    """Points in the part frame that a tool goes to one after the other.

    Between two points its tip goes straight, and the tool turns evenly with the way, about one axis.
    The feed is that of the tip; it is lower where the tool would turn faster than it may.  Where the
    tip stays, the tool rests, turns, and rests.

    Attributes:
        position: The points [m], (n, 3), n >= 2; none is its predecessor in place and rotation.
        rotation: Rotations part_from_tool at them, (n,).
        feed: Speeds to each [m/s], (n,); the first one is not used.
        rests: Whether the tool rests at each, beside corners [1], (n,).
        waits: Durations of its rests at those behind the first [s], (n - 1,).
        duration: Times of the ways to each [s], (n,), which count instead of the feed, NaN where the
            feed counts; none: it does everywhere.  Starts and stops take longer.
    """

    position: np.ndarray
    rotation: Rotation
    feed: np.ndarray
    rests: np.ndarray
    waits: np.ndarray
    duration: np.ndarray = field(default_factory=lambda: np.full(1, np.nan))

    @cached_property
    def _steps(self) -> np.ndarray:
        return np.diff(self.position, axis=0)

    @cached_property
    def _distances(self) -> np.ndarray:
        distances: np.ndarray = np.linalg.norm(self._steps, axis=1)
        return distances

    @cached_property
    def _turns(self) -> Rotation:
        """Rotations from point to point, part axes, (n - 1,)."""
        return self.rotation[1:] * self.rotation[:-1].inv()

    @cached_property
    def lengths(self) -> np.ndarray:  # type: ignore[override]
        """Ways from point to point, (n - 1,): lengths [m], or angles [rad] where the tip stays."""
        return np.where(self._distances > POINT_TOLERANCE, self._distances, self._turns.magnitude())

    def turn_jump(self, speeds: np.ndarray, stops: np.ndarray) -> float:
        """Return by how much the angular velocity of the tool jumps at a point at most [rad/s].

        Along the moves the tool turns by vectors phi in ways L; where two of them meet at a speed v
        without a rest, it is v |phi_1/L_1 - phi_2/L_2|.

        Args:
            speeds: Speeds to the points behind the first [m/s or rad/s], (n - 1,).
            stops: Whether the tool rests there [1], (n - 1,).
        """
        turns = self._turns.as_rotvec() / self.lengths[:, None]
        jumps = np.minimum(speeds[1:], speeds[:-1]) * np.linalg.norm(np.diff(turns, axis=0), axis=1)
        return float(np.max(jumps, initial=0.0, where=~stops[:-1]))

    def passing(self, law: PassingLaw) -> tuple[np.ndarray, np.ndarray]:
        """Return largest speeds to the points [m/s or rad/s], and whether the tool rests there."""
        stays, turns = self._distances <= POINT_TOLERANCE, self._turns.magnitude()
        rate = np.where(stays, law.fastest_turn, self.feed[1:])
        times = np.broadcast_to(self.duration, self.feed.shape)[1:]
        rate = np.divide(self.lengths, times, out=rate, where=np.isfinite(times))
        fastest = np.divide(
            law.fastest_turn * self.lengths,
            turns,
            out=rate.copy(),
            where=turns > POINT_TOLERANCE,
        )
        along = np.einsum("ij,ij->i", self._steps[1:], self._steps[:-1])
        straight = np.cos(law.corner) * self._distances[1:] * self._distances[:-1]
        stops = np.append((along < straight) | stays[1:] | stays[:-1], True)
        return np.minimum(rate, fastest), stops | self.rests[1:]

    def at(self, way: np.ndarray) -> tuple[np.ndarray, Rotation]:
        """Return points [m], (k, 3), and rotations at ways from the first point on, (k,)."""
        knots = np.append(0.0, np.cumsum(self.lengths))
        points = interpolate_rows(way, knots, self.position)
        return points, Slerp(knots, self.rotation)(np.clip(way, 0.0, knots[-1]))
