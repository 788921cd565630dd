"""Way over time: at the feeds of its pieces, smooth where they change, at rest where it has to be."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np


@dataclass(frozen=True)
class Travel:
    """Motion along a way, from rest to rest, whose pieces have speeds of their own.

    The speed is a mean over `blend` seconds, b, of a speed u that jumps,

        v(t) = integral of u(t - x) k(x) over x from 0 to b,    k(x) = (30/b) (x/b)^2 (1 - x/b)^2,

    so that a jump becomes the ramp 10 z^3 - 15 z^4 + 6 z^5, z = x/b, and the third derivative of the
    way is continuous.  Each feed f_i holds for half a blend longer at both sides of its piece, from
    S_i - f_i b/2 to S_i+1 + f_i b/2, and u is the lowest of those that hold.  A change of speed thus
    takes place within the faster piece, and the slower feed is reached at its border.

    The speed is never above the feed of the piece it is in: a blend that reaches beyond where a feed
    holds has its mean way beyond the piece, and any other is a mean of what is not above the feed.  Its
    rate is at most 1.875 f/b, as of a start to the largest feed f.  A stretch between two rests that u
    passes in less than a blend is passed more slowly, in one.

    Attributes:
        begin: Times from which the speeds u hold, rising from 0 [s], (m,).
        speed: The speeds u [m/s], or [rad/s] where the way is an angle, (m,); the last one is zero.
        way: The way that u has gone at those times [m or rad], (m,).
        blend: Duration b of a ramp [s].
        rests: Times at which the motion comes to rest, and at which it goes on after a wait, rising; the
            last one is its end [s], (r,).

    Example:
        >>> travel = Travel.along(np.array([0.1, 0.1]), np.array([0.1, 0.05]), blend=0.2)
        >>> travel.rests.round(9), travel.at(np.array([0.0, 1.15, 3.25])).round(9)
        (array([3.25]), array([0. , 0.1, 0.2]))
    """

    begin: np.ndarray
    speed: np.ndarray
    way: np.ndarray
    blend: float
    rests: np.ndarray

    @classmethod
    def along(
        cls,
        length: np.ndarray,
        feed: np.ndarray,
        blend: float,
        stops: np.ndarray | None = None,
        waits: np.ndarray | None = None,
    ) -> Travel:
        """Return the motion along pieces joined end to end.

        Args:
            length: Their lengths [m], or angles [rad], > 0, (n,), n >= 1.
            feed: Their speeds at most [m/s or rad/s], (n,).
            blend: Duration of a ramp [s].
            stops: Whether the motion comes to rest behind each [1], (n,); None: only behind the last
                one, at which it does in any case.
            waits: Durations of the rests behind each [s], (n,); None: zeros.
        """
        stops = np.zeros(len(length), dtype=bool) if stops is None else stops.copy()
        stops[-1] = True
        ends = np.cumsum(length)
        edges, speed, last = _limits(ends, feed, blend, stops)
        duration = np.diff(edges) / speed
        # In less than a blend nothing can start and stop: that takes one.
        first = np.append(0, last[:-1] + 1)
        longer = np.maximum(blend / np.add.reduceat(duration, first), 1.0)
        longer = np.repeat(longer, np.diff(np.append(first, len(speed))))
        duration, speed = duration * longer, speed / longer
        # Behind each stretch the ramp comes to rest within a blend, in which u is zero.
        wait = np.zeros(len(last)) if waits is None else waits[stops]
        duration = np.insert(duration, last + 1, blend + wait)
        speed, way = (
            np.insert(values, last + 1, more)
            for values, more in ((speed, 0.0), (edges[:-1], edges[last + 1]))
        )
        begin = np.append(0.0, np.cumsum(duration[:-1]))
        dwell = begin[speed == 0.0] + blend
        rests = np.sort(np.append(dwell, (dwell + wait)[wait > 0.0]))
        return cls(begin, speed, way, blend, rests)

    def at(self, time: np.ndarray) -> np.ndarray:
        """Return the way gone [m or rad], (k,), at times from 0 to the end [s], (k,)."""
        settled = np.searchsorted(self.begin, time - self.blend, side="right")
        later = np.searchsorted(self.begin, time, side="right")
        before = np.maximum(settled - 1, 0)
        # What jumped a blend ago and more has gone on since, half a blend late.
        since = time - self.begin[before] - 0.5 * self.blend
        way = np.where(settled > 0, self.way[before] + self.speed[before] * since, 0.0)
        jump = np.diff(self.speed, prepend=0.0)
        rows, number = np.arange(len(time)), settled
        while len(rows := rows[number[rows] < later[rows]]):
            which = number[rows]
            way[rows] += jump[which] * self._ramp(time[rows] - self.begin[which])
            number = number + 1
        gone: np.ndarray = np.clip(way, 0.0, self.way[-1])
        return gone

    def _ramp(self, time: np.ndarray) -> np.ndarray:
        """Return the way [s] of a speed that rises from 0 to 1 within a blend, (k,)."""
        u = time / self.blend
        distance: np.ndarray = self.blend * u**4 * (2.5 - 3.0 * u + u**2)
        return distance


def _limits(
    ends: np.ndarray, feed: np.ndarray, blend: float, stops: np.ndarray
) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Return where u jumps, u between, and the numbers of what lies before each stop.

    Args:
        ends: Ends of the pieces, (n,).
    """
    new = np.append(True, stops[:-1] | (feed[1:] != feed[:-1]))
    first = np.flatnonzero(new)
    final = np.append(first[1:] - 1, len(ends) - 1)
    feed, stops = feed[first], stops[final]
    begin, end = np.append(0.0, ends[final[:-1]]), ends[final]
    # Each feed holds half a blend longer at both sides, but not beyond a stop.
    stretch = np.append(0, np.cumsum(stops[:-1]))
    low, high = np.append(0.0, end[stops][:-1])[stretch], end[stops][stretch]
    reach = 0.5 * blend * feed
    from_, to = np.maximum(begin - reach, low), np.minimum(end + reach, high)
    edges = np.unique(np.concatenate([from_, to]))
    speed = _lowest(np.searchsorted(edges, from_), np.searchsorted(edges, to), feed, len(edges) - 1)
    last = np.searchsorted(edges, end[stops]) - 1
    changes = np.append(speed[1:] != speed[:-1], True)
    changes[last] = True
    first_cells = np.flatnonzero(changes)
    return (
        np.append(0.0, edges[first_cells + 1]),
        speed[first_cells],
        np.searchsorted(first_cells, last),
    )


def _lowest(first: np.ndarray, last: np.ndarray, value: np.ndarray, count: int) -> np.ndarray:
    """Return the lowest value of the ranges that cover each of so many cells, (count,).

    A range is two overlapping ones of a power of two cells, and each of those two of half as many.

    Args:
        first, last: Numbers of the first cell of each range and of the one behind it, (n,).
        value: Their values, (n,).

    Example:
        >>> _lowest(np.array([0, 1]), np.array([3, 5]), np.array([2.0, 1.0]), 5)
        array([2., 1., 1., 1., 1.])
    """
    level = np.frexp(last - first)[1] - 1
    lowest = np.full(count, np.inf)
    for power in range(int(level.max()), -1, -1):
        cells, is_level = 1 << power, level == power
        halves = lowest.copy()
        np.minimum(lowest[:-cells], halves[cells:], out=halves[cells:])
        lowest = halves
        np.minimum.at(lowest, first[is_level], value[is_level])
        np.minimum.at(lowest, last[is_level] - cells, value[is_level])
    return lowest
