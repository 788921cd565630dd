"""Which arcs of a mill are in the cut along a path, and how deep: from the stock that it removes.

What is left of the stock is a height field, so that an edge that meets material does so from its tip up
to one height: an engagement is a few arcs, each with its depth.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from itertools import pairwise
from typing import Protocol

import numpy as np

from coupling.path.linear import arc_length
from coupling.process.floor import Floor
from coupling.process.stock import RAW, RawStock, Stock

# Angles at which the cutter looks for material, over the half of it that cuts.
_ANGLES = 180
# Way of the tip from one look to the next, in radii.
_STEP = 0.05
# Material thinner than this part of a cell is rounding; arcs shorter than this are none [rad].
_THINNEST, _SHORTEST = 0.004, 1e-3
# A turn of the tip's way that is not passed over [rad], and one behind which arcs do not go on.
_CORNER, _STRAIGHT = 0.05, 0.2
# A shorter way is none [m].
_STANDING = 1e-9
# Number of the mover of a border that the cutter makes as it goes.
_BY_ITSELF = -2


@dataclass(frozen=True)
class Arcs:
    """Arcs of a cutter that are in the cut, at k times.

    Attributes:
        start, end: Angles from the left of the feed, clockwise [rad], (k, arcs).
        depth: Axial depths from the tip up [m], (k, arcs); not positive where there is no arc.
        start_made, end_made, top_made: Times at which the surfaces at the ends of the arcs and on top
            were made [s], (k, arcs); -1: raw stock; nan: by the cutter as it goes, which is no border.
    """

    start: np.ndarray
    end: np.ndarray
    depth: np.ndarray
    start_made: np.ndarray
    end_made: np.ndarray
    top_made: np.ndarray

    @property
    def is_cut(self) -> np.ndarray:
        """Mask of the arcs in the cut, (k, arcs)."""
        mask: np.ndarray = (self.end > self.start) & (self.depth > 0.0)
        return mask

    def section(self, radius: float) -> np.ndarray:
        """Return the section of the material in front of a cutter, across its feed [m^2], (k,)."""
        width = np.cos(self.start) - np.cos(self.end)
        section: np.ndarray = radius * np.sum(width * self.depth * self.is_cut, axis=1)
        return section


class ArcsOverTime(Protocol):
    """Arcs of a cutter along its desired path, and its end."""

    def at(self, time: np.ndarray) -> Arcs:
        """Return the arcs at times [s], (m,)."""

    def end_share(self, time: np.ndarray) -> np.ndarray:
        """Return the shares of the area of its end that cut at times [s], (m,)."""


@dataclass(frozen=True)
class RemovedStock:
    """What a cutter meets along a path that removes its stock, which is computed when it is asked for.

    Attributes:
        time: Times of the path, rising [s], (n,).
        tips: Path of the tip in the part [m], (n, 3).
        raw: Raw stock.
        radius: Radius of the cutter [m].
        cell: Side of a cell of the raster [m]; None: a 40th of the radius, or more for large parts.

    Example:
        >>> way = np.linspace(0.0, 0.1, 201)
        >>> tips = np.column_stack([way, 0.0 * way, 0.0 * way - 2e-3])
        >>> slot = RemovedStock(way / 0.05, tips, RawStock(surface=0.0), radius=8e-3)
        >>> middle = slot.at(np.array([1.0]))
        >>> [values.round(6).tolist() for values in (middle.start, middle.end, middle.depth)]
        [[[0.0]], [[3.141593]], [[0.002]]]
    """

    time: np.ndarray
    tips: np.ndarray
    raw: RawStock
    radius: float
    cell: float | None = None

    def at(self, time: np.ndarray) -> Arcs:
        """Return the arcs at times [s], (m,): straight between places that have as many, else held."""
        return self.removal.at(time)

    def end_share(self, time: np.ndarray) -> np.ndarray:
        """Return the shares of the area of the cutter's end that cut at times [s], (m,)."""
        share: np.ndarray = self.removal.end_share[self.removal.piece_at(time)]
        return share

    @cached_property
    def removal(self) -> Removal:
        """The removal of the whole path."""
        instants, points = _stations(self.time, self.tips, _STEP * self.radius)
        cuts = np.minimum(points[1:, 2], points[:-1, 2]) < self.raw.surface
        middles = 0.5 * (instants[1:] + instants[:-1])
        feeds = _feeds(points)
        rows: list[list[_Arc]] = [[] for _ in middles]
        end_share, volume = np.zeros(len(middles)), 0.0
        if cuts.any():
            begins, ends = np.flatnonzero(cuts), np.flatnonzero(cuts) + 1
            tips = points[np.union1d(begins, ends)]
            stock = Stock(self.raw, tips, self.radius, self.cell)
            floor = Floor(self.raw, tips, self.radius)
            before = stock.volume()
            for number in begins.tolist():
                begin, end = points[number], points[number + 1]
                middle = 0.5 * (begin + end)
                rows[number] = _arcs(stock, floor, middle, feeds[number], self.radius)
                stock.remove(begin, end, number)
                end_share[number] = floor.cut(begin, end)
            volume = before - stock.volume()
        return Removal(
            middles,
            0.5 * (points[1:, 2] + points[:-1, 2]),
            feeds,
            np.diff(arc_length(points[:, :2])),
            _table(middles, rows),
            end_share,
            volume,
        )


@dataclass(frozen=True)
class Removal:
    """What a cutter removed along its way, piece by piece; a piece is 1/20 of its radius.

    Attributes:
        time: Times in the middle of the pieces [s], (k,).
        height: Heights of the tip there in the part [m], (k,).
        feed: Unit vectors along the feed in the part's x-y plane, (k, 2).
        length: Lengths of the pieces in that plane [m], (k,).
        arcs: Arcs in their middle.
        end_share: Shares of the area of the cutter's end that cut, where it goes down [1], (k,).
        volume: Volume removed [m^3].
    """

    time: np.ndarray
    height: np.ndarray
    feed: np.ndarray
    length: np.ndarray
    arcs: Arcs
    end_share: np.ndarray
    volume: float

    def piece_at(self, time: np.ndarray) -> np.ndarray:
        """Return the numbers of the pieces at times [s], (m,)."""
        piece: np.ndarray = np.searchsorted(0.5 * (self.time[1:] + self.time[:-1]), time)
        return piece

    def at(self, time: np.ndarray) -> Arcs:
        """Return the arcs at times [s], (m,): straight between places that have as many, else held."""
        arcs = self.arcs
        after = np.searchsorted(self.time, time).clip(1, max(len(self.time) - 1, 1))
        before, after = after - 1, np.minimum(after, len(self.time) - 1)
        span = np.maximum(self.time[after] - self.time[before], _STANDING)
        share = np.clip((time - self.time[before]) / span, 0.0, 1.0)
        nearest = np.where(share < 0.5, before, after)
        share = np.where(self._goes_on[before], share, nearest != before)[:, None]
        start, end, depth = (
            (1.0 - share) * table[before] + share * table[after]
            for table in (arcs.start, arcs.end, arcs.depth)
        )
        limits_made = (table[nearest] for table in (arcs.start_made, arcs.end_made, arcs.top_made))
        return Arcs(start, end, depth, *limits_made)

    @cached_property
    def _goes_on(self) -> np.ndarray:
        """Whether the arcs of the next place go on those of each, (k,)."""
        count = np.count_nonzero(self.arcs.is_cut, axis=1)
        straight = np.sum(self.feed[1:] * self.feed[:-1], axis=1) > np.cos(_STRAIGHT)
        return np.append((count[1:] == count[:-1]) & straight, False)


@dataclass(frozen=True)
class StatedArcs:
    """One arc all along a path, whose sides are raw stock; as deep as the stock that the path removes.

    Attributes:
        removed: Stock that the cutter meets.
        start, end: Angles from the left of the feed, clockwise [rad]; 0 and pi are no sides.
    """

    removed: RemovedStock
    start: float
    end: float

    def at(self, time: np.ndarray) -> Arcs:
        """Return the arc at times [s], (m,)."""
        top, made = self._tops
        piece, shape = self.removed.removal.piece_at(time), (len(time), 1)
        depth = top[piece] - np.interp(time, self.removed.time, self.removed.tips[:, 2])
        return Arcs(
            np.full(shape, self.start),
            np.full(shape, self.end),
            np.where(np.isnan(depth), 0.0, depth)[:, None],
            np.full(shape, -1.0 if self.start > 0.0 else np.nan),
            np.full(shape, -1.0 if self.end < np.pi else np.nan),
            made[piece, None],
        )

    def end_share(self, time: np.ndarray) -> np.ndarray:
        """Return the shares of the area of the cutter's end that cut at times [s], (m,)."""
        return self.removed.end_share(time)

    @cached_property
    def _tops(self) -> tuple[np.ndarray, np.ndarray]:
        """Heights of the stock over each piece of the way [m], and when they were made [s], (k,) each.

        Of the arcs there the one of the largest section on the stated side counts; where there is none
        on that side, of all.  Above the raw stock it is the raw surface, nan where nothing is left.
        """
        removal, surface = self.removed.removal, self.removed.raw.surface
        met, height = removal.arcs, removal.height
        low, high = np.clip([met.start, met.end], self.start, self.end)
        stated, whole = (
            np.where(met.is_cut, (np.cos(begin) - np.cos(end)) * met.depth, 0.0)
            for begin, end in ((low, high), (met.start, met.end))
        )
        section = np.where(stated.any(axis=1, keepdims=True), stated, whole)
        row, deepest = np.arange(len(height)), np.argmax(section, axis=1)
        cuts, above = section.any(axis=1), height >= surface
        top = np.where(above, surface, np.nan)
        return (
            np.where(cuts, met.depth[row, deepest] + height, top),
            np.where(cuts, met.top_made[row, deepest], np.where(above, -1.0, np.nan)),
        )


@dataclass(frozen=True)
class _Arc:
    """An arc with a depth, and the moves that made the surfaces at its start, its end and on top."""

    start: float
    end: float
    depth: float
    removers: tuple[int, int, int]


def _table(time: np.ndarray, rows: list[list[_Arc]]) -> Arcs:
    table = np.zeros((6, len(rows), max(1, max((len(arcs) for arcs in rows), default=1))))
    removal_time = np.append(
        time, [np.nan, -1.0]
    )  # by its number; _BY_ITSELF and RAW are the last two
    for place, arcs in enumerate(rows):
        for column, arc in enumerate(arcs):
            removal_times = removal_time[list(arc.removers)]
            table[:, place, column] = (arc.start, arc.end, arc.depth, *removal_times)
    return Arcs(*table)


def _arcs(
    stock: Stock, floor: Floor, tip: np.ndarray, feed: np.ndarray, radius: float
) -> list[_Arc]:
    """Return the arcs of a cutter whose tip (3,) goes along a feed (2,), by angle.

    A floor on a slope lies within a layer, and it is the floor's height that counts.
    """
    lowest = stock.bottom_layer(tip[2])
    if lowest == len(stock.borders) - 1:
        return []
    turn = np.pi / _ANGLES
    phi = turn * (np.arange(_ANGLES) + 0.5)
    leftward = np.array([-feed[1], feed[0]])
    points = tip[:2] + radius * (np.outer(np.sin(phi), feed) + np.outer(np.cos(phi), leftward))
    distance = stock.material(points, lowest)
    is_material = np.logical_and.accumulate(distance > _THINNEST * stock.cell, axis=0)
    layers = is_material.sum(axis=0)
    first = np.append(0, np.flatnonzero(np.diff(layers)) + 1)
    last = np.append(first[1:], _ANGLES) - 1
    # Between two runs the border of the lowest layer that ends there, and who made it.
    borders, makers = [0.0], [_BY_ITSELF]
    for before, behind in zip(last[:-1].tolist(), first[1:].tolist(), strict=True):
        layer = int(min(layers[before], layers[behind]))
        a, b = np.abs(distance[layer, [before, behind]])
        borders.append(float(phi[before] + turn * a / max(a + b, _STANDING)))
        air = before if layers[before] < layers[behind] else behind
        makers.append(stock.remover(points[air], lowest + layer))
    borders.append(np.pi)
    makers.append(_BY_ITSELF)
    arcs = []
    for k, (begin, end) in enumerate(pairwise(borders)):
        count = int(layers[first[k]])
        if not count or end - begin <= _SHORTEST:
            continue
        here = points[first[k] : last[k] + 1]
        top = stock.remover(here[len(here) // 2], lowest + count)
        height = stock.borders[lowest + count]
        if top != RAW:
            low, high = stock.middles[lowest + count - 1 : lowest + count + 1]
            height = np.clip(np.median(floor.height(here)), low, high)
        if (depth := float(height - tip[2])) > 0.0:
            arcs.append(_Arc(begin, end, depth, (makers[k], makers[k + 1], top)))
    return arcs


def _stations(time: np.ndarray, tips: np.ndarray, step: float) -> tuple[np.ndarray, np.ndarray]:
    """Return times and places of a tip a step apart along its way, its corners included."""
    has_moved = np.append(True, np.linalg.norm(np.diff(tips, axis=0), axis=1) > _STANDING)
    time, tips = time[has_moved], tips[has_moved]
    if len(time) < 2:
        return np.repeat(time[:1], 2), np.repeat(tips[:1], 2, axis=0)
    gone = arc_length(tips)
    along = np.diff(tips, axis=0) / np.diff(gone)[:, None]
    turns = np.linalg.norm(np.diff(along, axis=0), axis=1) > _CORNER
    corners = np.concatenate([[0.0], gone[1:-1][turns], gone[-1:]])
    pieces = np.ceil(np.diff(corners) / step).astype(int)
    stops = np.concatenate(
        [
            np.linspace(low, high, count, endpoint=False)
            for low, high, count in zip(corners[:-1], corners[1:], pieces, strict=True)
        ]
        + [gone[-1:]]
    )
    places = [np.interp(stops, gone, values) for values in (time, *tips.T)]
    return places[0], np.column_stack(places[1:])


def _feeds(points: np.ndarray) -> np.ndarray:
    """Return the feed of each piece in the x-y plane, (n - 1, 2); of a plunge that of the one before."""
    ways = np.diff(points[:, :2], axis=0)
    length = np.linalg.norm(ways, axis=1)
    moves = length > 1e-3 * np.linalg.norm(np.diff(points, axis=0), axis=1)
    moves &= length > _STANDING
    if not moves.any():
        return np.tile([1.0, 0.0], (len(ways), 1))
    last = np.maximum.accumulate(np.where(moves, np.arange(len(ways)), -1))
    at = np.where(last < 0, int(np.argmax(moves)), last)
    feeds: np.ndarray = ways[at] / length[at, None]
    return feeds
