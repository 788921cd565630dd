"""Motion along a chain of curves: at rest in the corners, at the feed between them."""

from __future__ import annotations

from abc import abstractmethod
from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass

import numpy as np

from coupling.errors import CaseError
from coupling.files.toml_file import Positive
from coupling.path.frame import Frame
from coupling.toolpaths.feed import NO_FEED, turned_to
from coupling.toolpaths.instants import NO_CORNERS, Corners, PathTimes
from coupling.toolpaths.part import tool_path
from coupling.toolpaths.segments import Segment
from coupling.toolpaths.table import ToolPathTable
from coupling.toolpaths.travel import Travel
from coupling.toolpaths.untilted import UntiltedPath

# Headings are one if they differ by less [rad].
_HEADING_TOLERANCE = 1e-9

# Samples of a path from a file at most.
_MOST_SAMPLES = 2_000_000


class SegmentedPath(ToolPathTable):
    """A tool path along segments.

    Keys: feed_m_s between the corners, blend_s of starts and stops, sample_s; turn_s, for which the
    tool rests in a corner and turns, where its tilt is measured from the path.
    """

    feed_m_s: Positive
    blend_s: Positive = 0.2
    turn_s: Positive = 1.0
    sample_s: Positive = 0.02

    def untilted(self, part: Frame, corners: Corners = NO_CORNERS) -> UntiltedPath:
        """Return the tool path in the world before the tool is turned.

        Raises:
            CaseError: If tilts are measured from a feed that it does not have, or there are too many
                samples.
        """
        segments, follows = list(self._segments()), self.tilt_frame == "path"
        if follows and all(segment.heading is None for segment in segments):
            raise CaseError(NO_FEED)
        motion = follow(segments, self.feed_m_s, self.blend_s, self.turn_s if follows else 0.0)
        require_few(float(motion.ends[-1]) / self.sample_s, "tool_path")
        instants = PathTimes.of(motion.ends, self.sample_s, corners)
        states = motion.at(instants.time)
        path = tool_path(part, instants.time, states[:, :3])
        untilted = UntiltedPath(part, path, instants.sample_rows)
        return untilted.headed(states[:, 3]) if follows else untilted

    @abstractmethod
    def _segments(self) -> Iterable[Segment]:
        """Return the segments in the part frame, joined end to end."""


def require_few(samples: float, where: object) -> None:
    """Refuse a path of more samples than fit into memory: its feed or period is in a wrong unit.

    Raises:
        CaseError: If there are more.
    """
    if not samples <= _MOST_SAMPLES:
        raise CaseError(
            f"{where}: expected a path of at most {_MOST_SAMPLES} samples, got more: look at its feeds"
            " and at sample_s"
        )


@dataclass(frozen=True)
class Leg:
    """A motion from rest to rest.

    Attributes:
        duration: Duration [s], > 0.
        at: Function from times since its start (k,) to rows of what moves (k, columns).
    """

    duration: float
    at: Callable[[np.ndarray], np.ndarray]


@dataclass(frozen=True)
class Motion:
    """Motions from rest to rest, one after the other: a function of time.

    Attributes:
        legs: The motions, at least one.

    Example:
        >>> from coupling.toolpaths.segments import polyline
        >>> motion = follow(polyline(np.eye(2, 3) * [[0.0], [0.1]]), feed=0.1, blend=0.2)
        >>> motion.ends.round(9), motion.at(np.array([0.0, 0.6, 1.2]))[:, 1].round(9)
        (array([1.2]), array([0.  , 0.05, 0.1 ]))
    """

    legs: Sequence[Leg]

    @property
    def ends(self) -> np.ndarray:
        """Time at which each of the motions ends, the first beginning at 0 [s], (legs,)."""
        return np.cumsum([leg.duration for leg in self.legs])

    def at(self, time: np.ndarray) -> np.ndarray:
        """Return all that moves, (k, columns), at rising times from 0 to the end [s], (k,)."""
        ends = self.ends
        first = np.searchsorted(time, np.append(0.0, ends[:-1]), side="right")
        first[0], last = 0, np.append(first[1:], len(time))
        values = [
            leg.at(np.clip(time[a:b] - (end - leg.duration), 0.0, leg.duration))
            for leg, end, a, b in zip(self.legs, ends, first, last, strict=True)
            if b > a
        ]
        return np.concatenate(values)


def follow(segments: Sequence[Segment], feed: float, blend: float, turn: float = 0.0) -> Motion:
    """Return the motion along segments, each from rest to rest.

    The speed rises over `blend` seconds, stays at the feed and falls over `blend` seconds, with a
    continuous third derivative of the position.  A segment too short for that is driven at a lower
    speed.

    Its rows are points [m] and, in the fourth column, the angle of the feed about the z axis from x,
    continuous within segments [rad].

    Args:
        segments: Curves joined end to end.
        feed: Speed between the corners [m/s].
        blend: Duration of a start or stop [s].
        turn: Duration of a rest in each corner, in which the heading turns the shorter way, with a
            continuous second derivative; 0: the tool goes on at once [s].
    """
    first_headings = [
        segment_of_path.heading(np.zeros(1))
        for segment_of_path in segments
        if segment_of_path.heading is not None
    ]
    heading, legs = float(first_headings[0][0]) if first_headings else 0.0, []
    for segment in segments:
        leg = _plan_headings(segment, feed, blend, heading)
        start = leg.at(np.zeros(1))[0]
        if turn > 0.0 and abs(start[3] - heading) > _HEADING_TOLERANCE:
            legs.append(_turning(start[:3], heading, float(start[3]), turn))
        legs.append(leg)
        heading = float(leg.at(np.array([leg.duration]))[0, 3])
    return Motion(legs)


def _plan_headings(segment: Segment, feed: float, blend: float, before: float) -> Leg:
    """Return the motion along a segment with its headings, at most half a turn from one before it."""
    travel = Travel.along(np.array([segment.length]), np.array([feed]), blend)
    heading = segment.heading or (lambda s: np.full_like(s, before))
    start = float(heading(np.zeros(1))[0])
    shift = turned_to(before, start) - start

    def at(time: np.ndarray) -> np.ndarray:
        way = travel.at(time)
        return np.column_stack([segment.point(way), heading(way) + shift])

    return Leg(float(travel.rests[-1]), at)


def _turning(point: np.ndarray, before: float, behind: float, duration: float) -> Leg:
    """Return a rest at a point in which the heading turns [rad]."""

    def at(time: np.ndarray) -> np.ndarray:
        u = time / duration
        heading = before + (behind - before) * u**3 * (10.0 - 15.0 * u + 6.0 * u**2)
        return np.column_stack([np.tile(point, (len(time), 1)), heading])

    return Leg(duration, at)
