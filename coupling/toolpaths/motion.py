"""Motion along a chain of curves: at rest in the corners, at the feed between them."""

from __future__ import annotations

from abc import abstractmethod
from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass, replace
from itertools import pairwise

import numpy as np

from coupling.errors import CaseError
from coupling.files.toml_file import Positive
from coupling.toolpaths.feed import NO_FEED, turned_to
from coupling.toolpaths.part import Part
from coupling.toolpaths.table import ToolPathTable
from coupling.toolpaths.upright import UprightPath

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
    """Return the straight segment on which the tool moves from one cut to the next."""
    return replace(straight(start, end), heading=None)


def polyline(points: Iterable[np.ndarray]) -> list[Segment]:
    """Return the straight segments from point to point [m], (3,) each."""
    return [straight(start, end) for start, end in pairwise(points)]


def circle(center: np.ndarray, radius: float) -> Segment:
    """Return a full horizontal circle about the z axis through `center`, starting at +x [m]."""

    def point(s: np.ndarray) -> np.ndarray:
        angle = s / radius
        return center + radius * np.column_stack([np.cos(angle), np.sin(angle), np.zeros_like(s)])

    return Segment(2.0 * np.pi * radius, point, lambda s: 0.5 * np.pi + s / radius)


class Driven(ToolPathTable):
    """A tool path along segments.

    Keys: feed_m_s between the corners, blend_s of starts and stops, sample_s; turn_s, for which the
    tool rests in a corner and turns, where its tilt is measured from the path.
    """

    feed_m_s: Positive
    blend_s: Positive = 0.2
    turn_s: Positive = 1.0
    sample_s: Positive = 0.02

    def upright(self, part: Part) -> UprightPath:
        """Return the tool path in the world before the tool is turned.

        Raises:
            CaseError: If tilts are measured from a feed that it does not have.
        """
        segments, follows = list(self._segments()), self.tilt_frame == "path"
        if follows and all(own.heading is None for own in segments):
            raise CaseError(NO_FEED)
        turn = self.turn_s if follows else 0.0
        motion = follow(segments, self.feed_m_s, self.blend_s, self.sample_s, turn)
        upright = UprightPath(part, part.tool_path(motion.time, motion.points))
        return upright.headed(motion.heading) if follows else upright

    @abstractmethod
    def _segments(self) -> Iterable[Segment]:
        """Return the segments in the part frame, joined end to end."""


def require_few(samples: float) -> None:
    """Refuse a path of more samples than fit into memory: its feed or period is in a wrong unit.

    Raises:
        ValueError: If there are more.
    """
    if not samples <= _MOST_SAMPLES:
        raise ValueError(
            f"expected a path of at most {_MOST_SAMPLES} samples, got more: look at its feeds and at"
            " sample_s"
        )


@dataclass(frozen=True)
class Motion:
    """Samples of a motion along segments.

    Attributes:
        time: [s], (n,).
        points: [m], (n, 3).
        heading: Angles of the feed about the z axis from x, continuous within segments [rad], (n,).
    """

    time: np.ndarray
    points: np.ndarray
    heading: np.ndarray


def follow(
    segments: Sequence[Segment], feed: float, blend: float, period: float, turn: float = 0.0
) -> Motion:
    """Sample the motion along segments, each from rest to rest.

    The speed rises over `blend` seconds, stays at the feed and falls over `blend` seconds, with a
    continuous third derivative of the position.  A segment too short for that is driven at a lower
    speed.  Durations are rounded up to whole periods, so that every corner is a sample.

    Args:
        segments: Curves joined end to end.
        feed: Speed between the corners [m/s].
        blend: Duration of a start or stop [s].
        period: Time between samples [s].
        turn: Duration of a rest in each corner, in which the heading turns the shorter way, with a
            continuous second derivative; 0: the tool goes on at once [s].
    """
    headings = [own.heading(np.zeros(1)) for own in segments if own.heading is not None]
    heading = float(headings[0][0]) if headings else 0.0
    points, angles = [segments[0].point(np.zeros(1))], [np.array([heading])]
    for segment in segments:
        s = _arcs(segment, feed, blend, period)
        curve = segment.point(s)
        own = np.full(len(s), heading) if segment.heading is None else segment.heading(s)
        own = own + (turned_to(heading, float(own[0])) - own[0])
        if turn > 0.0 and abs(own[0] - heading) > _SAME:
            u = np.linspace(0.0, 1.0, _periods(turn, period) + 1)[1:]
            points.append(np.tile(curve[0], (len(u), 1)))
            angles.append(heading + (own[0] - heading) * u**3 * (10.0 - 15.0 * u + 6.0 * u**2))
        points.append(curve[1:])
        angles.append(own[1:])
        heading = float(own[-1])
    samples = np.vstack(points)
    return Motion(np.arange(len(samples)) * period, samples, np.concatenate(angles))


def _periods(duration: float, period: float) -> int:
    """Return how many whole periods a duration takes."""
    return int(np.ceil(duration / period - 1e-9))


def drive(segment: Segment, feed: float, blend: float, period: float) -> np.ndarray:
    """Sample the motion along one segment from rest to rest, as `follow`; points [m], (k, 3)."""
    return segment.point(_arcs(segment, feed, blend, period))


def _arcs(segment: Segment, feed: float, blend: float, period: float) -> np.ndarray:
    """Return the arc lengths at the samples of a motion from rest to rest [m], (k,)."""
    cruise = max(segment.length / feed - blend, 0.0)
    steps = _periods(cruise + 2.0 * blend, period)
    duration = steps * period
    speed = segment.length / (duration - blend)
    t = np.arange(steps + 1) * period
    arcs: np.ndarray = np.clip(speed * _distance(t, duration, blend), 0.0, segment.length)
    return arcs


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
