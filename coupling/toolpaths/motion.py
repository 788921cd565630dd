"""Motion along a chain of curves: at rest in the corners, at the feed between them."""

from __future__ import annotations

from abc import abstractmethod
from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from functools import partial

import numpy as np

from coupling.errors import CaseError
from coupling.files.toml_file import Positive
from coupling.path.frame import Frame
from coupling.toolpaths.feed import NO_FEED, turned_to
from coupling.toolpaths.instants import NO_CORNERS, Corners, PathTimes
from coupling.toolpaths.part import tool_path
from coupling.toolpaths.segments import Chain, Function, Segment
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
        require_few(float(motion.travel.rests[-1]) / self.sample_s, "tool_path")
        instants = PathTimes.of(motion.travel.rests, self.sample_s, corners)
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
class Motion:
    """Motion along segments, from rest to rest on each.

    Attributes:
        chain: The segments.
        travel: Way along them over time.
        headings: Functions from arc lengths (k,) of each segment to angles of the feed [rad], (k,).
        turns: Angles by which the heading turns in the rest behind each [rad], (segments,).

    Example:
        >>> from coupling.toolpaths.segments import polyline
        >>> motion = follow(polyline(np.eye(2, 3) * [[0.0], [0.1]]), feed=0.1, blend=0.2)
        >>> motion.travel.rests.round(9), motion.at(np.array([0.0, 0.6, 1.2]))[:, 1].round(9)
        (array([1.2]), array([0.  , 0.05, 0.1 ]))
    """

    chain: Chain
    travel: Travel
    headings: Sequence[Function]
    turns: np.ndarray

    def at(self, time: np.ndarray) -> np.ndarray:
        """Return points [m] and, in the fourth column, headings [rad] at rising times [s], (k, 4)."""
        lengths, is_turning = self.chain.lengths, self.turns != 0.0
        # Behind each segment it rests, and where the heading turns once more, until it has.
        rests = np.arange(len(lengths)) + np.cumsum(is_turning)
        which = np.searchsorted(self.travel.rests[rests[:-1]], time)
        begins = np.cumsum(lengths) - lengths
        along = np.clip(self.travel.at(time) - begins[which], 0.0, lengths[which])
        heading = np.empty(len(time))
        for k in np.unique(which).tolist():
            rows = slice(*np.searchsorted(which, [k, k + 1]))
            heading[rows] = self.headings[k](along[rows])
        for k in np.flatnonzero(is_turning).tolist():
            begin, end = self.travel.rests[rests[k] - 1 : rests[k] + 1]
            rows = slice(np.searchsorted(time, begin), np.searchsorted(time, end, side="right"))
            u = (time[rows] - begin) / (end - begin)
            step = u**3 * (10.0 - 15.0 * u + 6.0 * u**2)
            heading[rows] = self.headings[k](lengths[[k]]) + self.turns[k] * step
        return np.column_stack([self.chain.points_at(which, along), heading])


def follow(segments: Sequence[Segment], feed: float, blend: float, turn: float = 0.0) -> Motion:
    """Return the motion along segments, each from rest to rest.

    The speed rises over `blend` seconds, stays at the feed and falls over `blend` seconds, with a
    continuous third derivative of the position.  A segment too short for that is driven at a lower
    speed.  Headings, angles of the feed about the z axis from x, are continuous within segments.

    Args:
        segments: Curves joined end to end.
        feed: Speed between the corners [m/s].
        blend: Duration of a start or stop [s].
        turn: Duration of a rest in each corner, in which the heading turns the shorter way, with a
            continuous second derivative; 0: the tool goes on at once [s].
    """
    chain, origin, everywhere = Chain(segments), np.zeros(1), np.ones(len(segments), dtype=bool)
    first = next((s.heading for s in segments if s.heading is not None), None)
    before = 0.0 if first is None else float(first(origin)[0])
    headings: list[Function] = []
    turns = np.zeros(len(segments))
    for k, segment in enumerate(segments):
        heading = segment.heading or partial(np.full_like, fill_value=before)
        start = float(heading(origin)[0])
        after = turned_to(before, start)
        if turn > 0.0 and abs(after - before) > _HEADING_TOLERANCE:
            turns[k - 1] = after - before
        headings.append(partial(_shifted, heading, after - start))
        before = float(headings[-1](np.array([segment.length]))[0])
    waits, feeds = np.where(turns != 0.0, turn, 0.0), np.full(len(segments), feed)
    travel = Travel.along(chain.lengths, feeds, blend, everywhere, waits)
    return Motion(chain, travel, headings, turns)


def _shifted(heading: Function, shift: float, way: np.ndarray) -> np.ndarray:
    return heading(way) + shift
