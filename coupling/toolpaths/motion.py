"""Motion along a chain of curves: at rest in the corners, at the feed between them."""

from __future__ import annotations

from abc import abstractmethod
from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass, replace
from itertools import pairwise

import numpy as np

from coupling.errors import CaseError
from coupling.files.toml_file import Positive
from coupling.path.frame import Frame
from coupling.toolpaths.feed import NO_FEED, turned_to
from coupling.toolpaths.instants import NONE, Corners, PathTimes
from coupling.toolpaths.part import tool_path
from coupling.toolpaths.table import ToolPathTable
from coupling.toolpaths.untilted import UntiltedPath

# A straight segment that goes less far than this across the part's z axis is along it [m].
_ALONG = 1e-9
# Headings are one if they differ by less [rad].
_SAME = 1e-9

# Samples of a path from a file at most.
_MOST_SAMPLES = 2_000_000


@dataclass(frozen=True)
class Segment:
    """A smooth curve.

    Attributes:
        length: Arc length [m].
        point: Function from arc lengths (k,) to points (k, 3) [m].
        heading: Function from arc lengths to angles of the feed about the z axis from x [rad], (k,);
            None where the tool only moves from one cut to the next, and keeps the last heading.
    """

    length: float
    point: Callable[[np.ndarray], np.ndarray]
    heading: Callable[[np.ndarray], np.ndarray] | None = None


def straight(start: np.ndarray, end: np.ndarray) -> Segment:
    """Return the straight segment between two points [m], (3,); without heading along the z axis."""
    length = float(np.linalg.norm(end - start))
    direction = (end - start) / length
    along = np.linalg.norm((end - start)[:2]) < _ALONG
    angle = float(np.arctan2(direction[1], direction[0]))
    return Segment(
        length,
        lambda s: start + np.outer(s, direction),
        None if along else lambda s: np.full_like(s, angle),
    )


def link(start: np.ndarray, end: np.ndarray) -> Segment:
    """Return the straight segment between two points [m], (3,)."""
    return replace(straight(start, end), heading=None)


def polyline(points: Iterable[np.ndarray]) -> list[Segment]:
    """Return the straight segments from point to point [m], (3,) each."""
    return [straight(start, end) for start, end in pairwise(points)]


def circle(center: np.ndarray, radius: float) -> Segment:
    """Return a full horizontal circle about the z axis through `center` [m], (3,), from +x on."""

    def point(s: np.ndarray) -> np.ndarray:
        angle = s / radius
        return center + radius * np.column_stack([np.cos(angle), np.sin(angle), np.zeros_like(s)])

    return Segment(2.0 * np.pi * radius, point, lambda s: 0.5 * np.pi + s / radius)


class SegmentedPath(ToolPathTable):
    """A tool path along segments.

    Keys: feed_m_s between the corners, blend_s of starts and stops, sample_s; turn_s, for which the
    tool rests in a corner and turns, where its tilt is measured from the path.
    """

    feed_m_s: Positive
    blend_s: Positive = 0.2
    turn_s: Positive = 1.0
    sample_s: Positive = 0.02

    def untilted(self, part: Frame, corners: Corners = NONE) -> UntiltedPath:
        """Return the tool path in the world before the tool is turned.

        Raises:
            CaseError: If tilts are measured from a feed that it does not have, or there are too many
                samples.
        """
        segments, follows = list(self._segments()), self.tilt_frame == "path"
        if follows and all(own.heading is None for own in segments):
            raise CaseError(NO_FEED)
        motion = follow(segments, self.feed_m_s, self.blend_s, self.turn_s if follows else 0.0)
        require_few(float(motion.ends[-1]) / self.sample_s, "tool_path")
        instants = PathTimes.of(motion.ends, self.sample_s, corners)
        moved = motion.at(instants.time)
        path = tool_path(part, instants.time, moved[:, :3])
        untilted = UntiltedPath(part, path, instants.sample_rows)
        return untilted.headed(moved[:, 3]) if follows else untilted

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
        >>> leg = drive(straight(np.zeros(3), np.array([0.1, 0.0, 0.0])), feed=0.1, blend=0.2)
        >>> motion = Motion([leg, waiting(leg.at(np.array([leg.duration]))[0], 0.5)])
        >>> motion.ends.round(9), motion.at(np.array([0.0, 1.2, 1.7]))[:, 0].round(9)
        (array([1.2, 1.7]), array([0. , 0.1, 0.1]))
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
        found = [
            leg.at(np.clip(time[a:b] - (end - leg.duration), 0.0, leg.duration))
            for leg, end, a, b in zip(self.legs, ends, first, last, strict=True)
            if b > a
        ]
        return np.concatenate(found)


def waiting(values: np.ndarray, duration: float) -> Leg:
    """Return a rest of all that moves, (columns,), for a time [s]."""
    return Leg(duration, lambda time: np.tile(values, (len(time), 1)))


def drive(segment: Segment, feed: float, blend: float) -> Leg:
    """Return the motion of a point along a segment, from rest to rest.

    The speed rises over `blend` seconds, stays at the feed and falls over `blend` seconds, with a
    continuous third derivative of the position.  A segment too short for that is driven at a lower
    speed.

    Args:
        segment: The curve.
        feed: Speed between its ends [m/s].
        blend: Duration of a start or stop [s].
    """
    duration = max(segment.length / feed - blend, 0.0) + 2.0 * blend
    arc = _arc(segment, duration, blend)
    return Leg(duration, lambda time: segment.point(arc(time)))


def follow(segments: Sequence[Segment], feed: float, blend: float, turn: float = 0.0) -> Motion:
    """Return the motion along segments, each from rest to rest as `drive` has it.

    Its rows are points [m] and, in the fourth column, the angle of the feed about the z axis from x,
    continuous within segments [rad].

    Args:
        segments: Curves joined end to end.
        feed: Speed between the corners [m/s].
        blend: Duration of a start or stop [s].
        turn: Duration of a rest in each corner, in which the heading turns the shorter way, with a
            continuous second derivative; 0: the tool goes on at once [s].
    """
    known = [own.heading(np.zeros(1)) for own in segments if own.heading is not None]
    heading, legs = float(known[0][0]) if known else 0.0, []
    for segment in segments:
        leg = _headed(segment, feed, blend, heading)
        start = leg.at(np.zeros(1))[0]
        if turn > 0.0 and abs(start[3] - heading) > _SAME:
            legs.append(_turning(start[:3], heading, float(start[3]), turn))
        legs.append(leg)
        heading = float(leg.at(np.array([leg.duration]))[0, 3])
    return Motion(legs)


def _headed(segment: Segment, feed: float, blend: float, before: float) -> Leg:
    """Return the motion along a segment with its headings, at most half a turn from one before it."""
    driven = drive(segment, feed, blend)
    own = segment.heading or (lambda s: np.full_like(s, before))
    arc = _arc(segment, driven.duration, blend)
    start = float(own(np.zeros(1))[0])
    shift = turned_to(before, start) - start
    return Leg(
        driven.duration,
        lambda time: np.column_stack([driven.at(time), own(arc(time)) + shift]),
    )


def _turning(point: np.ndarray, before: float, behind: float, duration: float) -> Leg:
    """Return a rest at a point in which the heading turns [rad]."""

    def at(time: np.ndarray) -> np.ndarray:
        u = time / duration
        heading = before + (behind - before) * u**3 * (10.0 - 15.0 * u + 6.0 * u**2)
        return np.column_stack([np.tile(point, (len(time), 1)), heading])

    return Leg(duration, at)


def _arc(segment: Segment, duration: float, blend: float) -> Callable[[np.ndarray], np.ndarray]:
    """Return the function from times to arc lengths [m] of a motion from rest to rest."""
    speed = segment.length / (duration - blend)

    def arc(time: np.ndarray) -> np.ndarray:
        length: np.ndarray = np.clip(speed * _distance(time, duration, blend), 0.0, segment.length)
        return length

    return arc


def chain(segments: Sequence[Segment]) -> Segment:
    """Return segments joined end to end as one."""
    if len(segments) == 1:
        return segments[0]
    ends = np.cumsum([segment.length for segment in segments])

    def point(s: np.ndarray) -> np.ndarray:
        which = np.minimum(np.searchsorted(ends, s, side="left"), len(segments) - 1)
        points = np.empty((len(s), 3))
        for k in np.unique(which):
            own = which == k
            begin = ends[k] - segments[k].length
            points[own] = segments[k].point(np.clip(s[own] - begin, 0.0, segments[k].length))
        return points

    return Segment(float(ends[-1]), point)


def _distance(t: np.ndarray, duration: float, blend: float) -> np.ndarray:
    """Distance [s] travelled at unit speed, with ramps 10 u^3 - 15 u^4 + 6 u^5 of the speed."""

    def ramp(time: np.ndarray) -> np.ndarray:
        u = np.clip(time / blend, 0.0, 1.0)
        return blend * (2.5 * u**4 - 3.0 * u**5 + u**6) + np.maximum(time - blend, 0.0)

    return ramp(t) - ramp(t - (duration - blend))
