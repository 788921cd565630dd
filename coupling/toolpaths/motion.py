"""Motion along a chain of curves: at rest in the corners, at the feed between them."""

from __future__ import annotations

from abc import abstractmethod
from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass
from itertools import pairwise

import numpy as np

from coupling.files.toml_file import Positive
from coupling.path.histories import ToolPath
from coupling.toolpaths.part import Part
from coupling.toolpaths.task import ToolPathTable

# Samples of a path from a file at most.
_MOST_SAMPLES = 2_000_000


@dataclass(frozen=True)
class Segment:
    """A smooth curve.

    Attributes:
        length: Arc length [m].
        point: Function from arc lengths (k,) to points (k, 3) [m].
    """

    length: float
    point: Callable[[np.ndarray], np.ndarray]


def straight(start: np.ndarray, end: np.ndarray) -> Segment:
    """Return the straight segment between two points [m], (3,)."""
    length = float(np.linalg.norm(end - start))
    direction = (end - start) / length
    return Segment(length, lambda s: start + np.outer(s, direction))


def polyline(points: Iterable[np.ndarray]) -> list[Segment]:
    """Return the straight segments from point to point [m], (3,) each."""
    return [straight(start, end) for start, end in pairwise(points)]


def circle(center: np.ndarray, radius: float) -> Segment:
    """Return a full horizontal circle about the z axis through `center`, starting at +x [m]."""

    def point(s: np.ndarray) -> np.ndarray:
        angle = s / radius
        return center + radius * np.column_stack([np.cos(angle), np.sin(angle), np.zeros_like(s)])

    return Segment(2.0 * np.pi * radius, point)


class Driven(ToolPathTable):
    """A tool path along segments.

    Keys: feed_m_s between the corners, blend_s of starts and stops, sample_s.
    """

    feed_m_s: Positive
    blend_s: Positive = 0.2
    sample_s: Positive = 0.02

    def upright(self, part: Part) -> ToolPath:
        """Return the tool path in the world before the tool is turned."""
        time, points = follow(self._segments(), self.feed_m_s, self.blend_s, self.sample_s)
        return part.tool_path(time, points)

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


def follow(
    segments: Iterable[Segment], feed: float, blend: float, period: float
) -> tuple[np.ndarray, np.ndarray]:
    """Sample the motion along segments, each from rest to rest.

    The speed rises over `blend` seconds, stays at the feed and falls over `blend` seconds, with a
    continuous third derivative of the position.  A segment too short for that is driven at a lower
    speed.  Durations are rounded up to whole periods, so that every corner is a sample.

    Args:
        segments: Curves joined end to end.
        feed: Speed between the corners [m/s].
        blend: Duration of a start or stop [s].
        period: Time between samples [s].

    Returns:
        Time [s], (n,), and points [m], (n, 3).
    """
    points: list[np.ndarray] = []
    for segment in segments:
        curve = drive(segment, feed, blend, period)
        points.append(curve if not points else curve[1:])
    samples = np.vstack(points)
    return np.arange(len(samples)) * period, samples


def drive(segment: Segment, feed: float, blend: float, period: float) -> np.ndarray:
    """Sample the motion along one segment from rest to rest, as `follow`; points [m], (k, 3)."""
    cruise = max(segment.length / feed - blend, 0.0)
    steps = int(np.ceil((cruise + 2.0 * blend) / period - 1e-9))
    duration = steps * period
    speed = segment.length / (duration - blend)
    t = np.arange(steps + 1) * period
    s = np.clip(speed * _distance(t, duration, blend), 0.0, segment.length)
    return segment.point(s)


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
