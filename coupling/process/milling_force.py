"""Milling forces along the actual path: chip, engagement and depth follow from where the tool is."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from functools import cached_property

import numpy as np

from coupling.path.frame import Frame
from coupling.path.histories import ToolPath, WrenchHistory
from coupling.path.linear import interpolate_rows
from coupling.process.base import ProcessMemory, ProcessResponse, WithIdentity
from coupling.process.cutting_force import (
    Cutter,
    CuttingCoefficients,
    Engagement,
    Way,
    edge_share,
    end_wrench,
    mean_wrench,
    tooth_wrench,
)
from coupling.process.engaged_arcs import ArcsOverTime

# Samples that a tooth's passing needs at least; with fewer the robot would see a slower one.
SAMPLES_PER_TOOTH = 6
# Longest step that tells a robot's vibrations, at 200 Hz ten in each [s].
_LONGEST = 5e-4
# Gauss points and weights of the mean over a step.
_NODES, _WEIGHTS = np.polynomial.legendre.leggauss(3)
# Rows whose cuts are computed at once.
_AT_ONCE = 4096
# A tool slower than this has no direction of feed of its own [m/s].
_STANDING = 1e-6


@dataclass(frozen=True)
class ActualTip:
    """Where the tip's centre really is, straight between its times, held beyond them.

    Attributes:
        part: base_from_part.
        time: Rising times [s], (n,).
        position: Positions in the base [m], (n, 3).
    """

    part: Frame
    time: np.ndarray
    position: np.ndarray

    def at(self, time: np.ndarray) -> np.ndarray:
        """Return where it is in the part at times [s], (m,), [m], (m, 3)."""
        return self.part.coordinates(interpolate_rows(time, self.time, self.position))

    def way(self, begin: float, end: float) -> Way:
        """Return its way in the part's plane between two times [s], and a row beyond each."""
        first, last = np.searchsorted(self.time, [begin, end])
        near = slice(max(first - 1, 0), last + 1)
        return Way(self.time[near], self.part.coordinates(self.position[near])[:, :2])


@dataclass(frozen=True)
class Milling:
    """A milling cut along a desired path, in the part's x-y plane.

    Attributes:
        part: base_from_part.
        desired: Path of the tip's centre.
        cutter: The tool, its axis along the part's z.
        coefficients: Cutting coefficients of the material.
        engaged: Arcs that are in the cut along the desired path.
        end_edge: Length of the edges on the end of the cutter, from the rim inwards [m]; 0: none.
    """

    part: Frame
    desired: ToolPath
    cutter: Cutter
    coefficients: CuttingCoefficients
    engaged: ArcsOverTime
    end_edge: float = 0.0

    @cached_property
    def tips(self) -> np.ndarray:
        """Desired path of the tip in the part [m], (n, 3)."""
        return self.part.coordinates(self.desired.position[0])

    def feed_directions(self) -> np.ndarray:
        """Return unit vectors along the desired feed in the part's x-y plane, (n, 2).

        Where the tool stands or plunges it is the direction of the last feed, or of the first.
        """
        velocity, speed = self._velocity, self._speed
        moving = speed > _STANDING
        last = np.maximum.accumulate(np.where(moving, np.arange(len(speed)), -1))
        at = np.where(last < 0, int(np.argmax(moving)), last)
        return velocity[at] / np.maximum(speed[at], _STANDING)[:, None]

    def feed_at(self, time: np.ndarray) -> np.ndarray:
        """Return the directions of the desired feed at times [s], (m,): of the step there, (m, 2)."""
        rows = np.searchsorted(self.desired.time, time)
        return self._feed[np.minimum(rows, len(self._feed) - 1)]

    def descent(self, time: np.ndarray) -> np.ndarray:
        """Return the desired ways downwards from tooth to tooth at times [s], (m,): [m], >= 0."""
        down = -np.interp(time, self.desired.time, self._climb)
        return np.maximum(down, 0.0) * self.cutter.tooth_period

    def end_wrench(self, time: np.ndarray, length: float) -> np.ndarray:
        """Return the wrench of the cutter's end with edges of a length [m] on it, at times [s], (m, 6).

        It is that of the desired path, in axes of the cut: what is a part of a turn on material has
        that part of it.
        """
        share = self.engaged.end_share(time)
        wrench = end_wrench(self.cutter, self.coefficients, length, self.descent(time))
        return share[:, None] * wrench

    @cached_property
    def _climb(self) -> np.ndarray:
        climb: np.ndarray = np.gradient(self.tips[:, 2], self.desired.time)
        return climb

    @cached_property
    def _velocity(self) -> np.ndarray:
        velocity: np.ndarray = np.gradient(self.tips[:, :2], self.desired.time, axis=0)
        return velocity

    @cached_property
    def _speed(self) -> np.ndarray:
        speed: np.ndarray = np.linalg.norm(self._velocity, axis=1)
        return speed

    @cached_property
    def _feed(self) -> np.ndarray:
        return self.feed_directions()

    def cuts(
        self, tip: ActualTip, time: np.ndarray, feed: np.ndarray
    ) -> Iterator[tuple[np.ndarray, Engagement]]:
        """Yield the engagement of the arcs that are in the cut on an actual path, one at a time.

        The tool leaves its arcs as it deviates: it is deeper the more it sags, and reaches further into
        a side that lies along the feed. Both count from what cut that surface before, which deviated as
        well.

        Args:
            tip: Actual path of the tip.
            time: Instants [s], (m,).
            feed: Directions of the desired feed there, (m, 2).

        Yields:
            Numbers of the instants at which an arc is in the cut, (k,), and its engagement there.
        """
        now = tip.at(time)
        way = (now - tip.at(time - self.cutter.tooth_period))[:, :2]
        leftward = np.column_stack([-feed[:, 1], feed[:, 0]])
        chip = np.column_stack([np.sum(way * feed, axis=1), np.sum(way * leftward, axis=1)])
        offset = now - interpolate_rows(time, self.desired.time, self.tips)
        feed_per_tooth = np.interp(time, self.desired.time, self._speed) * self.cutter.tooth_period
        share = edge_share(feed_per_tooth)
        arcs = self.engaged.at(time)

        def extra_offset(since: np.ndarray, rows: np.ndarray) -> np.ndarray:
            """Return how much farther the tool is off than what made a surface was [m], (k, 3)."""
            earlier = np.flatnonzero(since >= 0.0)
            more = np.where(np.isnan(since)[:, None], 0.0, offset[rows])
            at = since[earlier]
            more[earlier] -= tip.at(at) - interpolate_rows(at, self.desired.time, self.tips)
            return more

        for arc in range(arcs.start.shape[1]):
            rows = np.flatnonzero(arcs.end[:, arc] > arcs.start[:, arc])
            depth = arcs.depth[rows, arc] - extra_offset(arcs.top_made[rows, arc], rows)[:, 2]
            rows, depth = rows[depth > 0.0], depth[depth > 0.0]
            start, end = (
                self._shifted_angle(
                    angle[rows, arc], extra_offset(since[rows, arc], rows), leftward[rows]
                )
                for angle, since in ((arcs.start, arcs.start_made), (arcs.end, arcs.end_made))
            )
            yield rows, Engagement(chip[rows], start, np.maximum(start, end), depth, share[rows])

    def _shifted_angle(
        self, angle: np.ndarray, more: np.ndarray, leftward: np.ndarray
    ) -> np.ndarray:
        """Return the angles at sides along the feed that a tool is nearer to by `more` [m], (k, 3)."""
        across = np.sum(more[:, :2] * leftward, axis=1)
        cosine = np.cos(angle) - across / self.cutter.radius
        angles: np.ndarray = np.where(across == 0.0, angle, np.arccos(np.clip(cosine, -1.0, 1.0)))
        return angles

    def in_base(self, wrench: np.ndarray, feed: np.ndarray) -> np.ndarray:
        """Turn wrenches from the axes of the cut to those of the base [N, N m], (n, 6)."""
        cos, sin = feed.T[..., None]
        f, n, z = np.moveaxis(wrench.reshape(-1, 2, 3), 2, 0)
        in_part = np.stack([cos * f - sin * n, sin * f + cos * n, z], axis=2)
        return self.part.rotate(in_part).reshape(-1, 6)


@dataclass(frozen=True)
class MillingForce(WithIdentity):
    """Base of forces of a milling cut.

    Attributes:
        milling: The cut.
    """

    milling: Milling


@dataclass(frozen=True)
class MeanForce(MillingForce):
    """Force averaged over a revolution, for samples far apart."""

    def evaluate(self, path: ToolPath) -> ProcessResponse:
        """Return the wrench along the actual path of the tool."""
        milling = self.milling
        tip = ActualTip(milling.part, path.time, path.position[0])
        wrench = np.concatenate([self._at(tip, time) for time in _in_parts(path.time)])
        return ProcessResponse(WrenchHistory(path.time, wrench), period=milling.cutter.tooth_period)

    def _at(self, tip: ActualTip, time: np.ndarray) -> np.ndarray:
        """Return the wrench in base axes at times [s], (m,), [N, N m], (m, 6)."""
        milling, wrench = self.milling, np.zeros((len(time), 6))
        feed = milling.feed_at(time)
        for rows, cut in milling.cuts(tip, time, feed):
            wrench[rows] += mean_wrench(milling.cutter, milling.coefficients, cut)
        if milling.end_edge:
            wrench += milling.end_wrench(time, milling.end_edge)
        return milling.in_base(wrench, feed)


@dataclass(frozen=True)
class ToothPassing(MillingForce):
    """Force of every tooth as it passes, which remembers what the passes before have left."""

    @property
    def marched(self) -> ToothPassing:
        """Itself: it is coupled marching in time."""
        return self

    @property
    def memory(self) -> ProcessMemory:
        """How far it looks back, and how its time is divided."""
        cutter = self.milling.cutter
        step = min(cutter.tooth_period / SAMPLES_PER_TOOTH, _LONGEST)
        # Side and floor that a level meets were made by the one before.
        return ProcessMemory(step, cutter.period, cutter.turn_period, np.inf)

    def evaluate(self, path: ToolPath) -> ProcessResponse:
        """Return the wrench along the actual path of the tool."""
        # Teeth come and go within a step: their impulse over it counts.
        history = WrenchHistory.of_means(path.time, self.means(path.time, path.pose, 0)[0])
        return ProcessResponse(history, period=self.milling.cutter.period)

    def means(self, time: np.ndarray, pose: np.ndarray, since: int) -> np.ndarray:
        """Return the mean wrenches over the steps that end at the rows from one on [N, N m].

        Args:
            time: Times from `memory` before that row on, or from the beginning [s], (n,).
            pose: Actual poses of the tip there [m, 1], (1, n, 7).
            since: Number of that row.

        Returns:
            Wrenches in base axes, (1, n - since, 6).
        """
        tip = ActualTip(self.milling.part, time, pose[0, :, :3])
        parts = [self._over_steps(tip, rows) for rows in _in_parts(np.arange(since, len(time)))]
        return np.concatenate(parts)[None]

    def _over_steps(self, tip: ActualTip, rows: np.ndarray) -> np.ndarray:
        """Return the mean wrenches in base axes over steps by their last rows [N, N m], (m, 6)."""
        milling, ends = self.milling, tip.time[rows]
        steps = ends - tip.time[np.maximum(rows - 1, 0)]
        time = (ends[:, None] - 0.5 * (1.0 - _NODES) * steps[:, None]).ravel()
        feed = milling.feed_at(time)
        way = tip.way(time[0] - milling.cutter.memory, ends[-1])
        wrench = np.zeros((len(time), 6))
        for at, cut in milling.cuts(tip, time, feed):
            wrench[at] += tooth_wrench(
                milling.cutter, milling.coefficients, cut, way, feed[at], time[at]
            )
        if milling.end_edge:
            wrench += milling.end_wrench(time, milling.end_edge)
        in_base = milling.in_base(wrench, feed).reshape(len(ends), len(_NODES), 6)
        return np.einsum("g,ngw->nw", 0.5 * _WEIGHTS, in_base)


def _in_parts(rows: np.ndarray) -> list[np.ndarray]:
    """Return rows of any kind, (n,), in parts whose cuts are computed at once: they take memory."""
    return np.array_split(rows, len(rows) // _AT_ONCE + 1)


FORCES: dict[str, type[MeanForce | ToothPassing]] = {
    "tooth-passing": ToothPassing,
    "mean": MeanForce,
}
