"""One gear along its whole path: from piece to piece of its torque curve, from reversal to reversal."""

from __future__ import annotations

import itertools
import math
from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from scipy.optimize import brentq

from coupling.inverse.gear_bends import collocate, follow_bend
from coupling.inverse.gear_elements import GearLaw
from coupling.inverse.gear_pieces import Piece
from coupling.inverse.gear_steps import Steps, follow_line, line_weights, shifted

# A piece is left where the angle passes its end by more than rounding [rad], so that a gear at its edge
# makes no chatter.  At a sharp edge this holds back torques up to k _SLACK, 1e-9 N m at 1e6 N m/rad; on
# a bend, whose angles are less exact, the slope is continuous and the law beyond is the neighbour's.
_SLACK = 1e-15
_SLACK_BENT = 1e-13
# Samples looked at in one go: few behind a change of piece, then more and more; a hundred take as long as one.
_FIRST = 128
_MOST_STRAIGHT = 65536
_MOST_BENT = 2048
# Steps behind a change of piece, by the shortest time constant of a piece that bends.
_FIRST_STEP = 0.25
_GROWTH = 1.6


@dataclass(frozen=True)
class GearPath:
    """Path of one gear.

    Attributes:
        angle: Wind-up at the samples [rad], (n,).
        torque: Torque of its spring and its elements there [N m], (n,).
        slope: Slope of that by the angle [N m/rad], (n,).
        entered: Times behind the first sample at which it came to a piece [s], the first one 0.
        visited: The pieces it came to.
    """

    angle: np.ndarray
    torque: np.ndarray
    slope: np.ndarray
    entered: list[float]
    visited: list[Piece]


@dataclass(frozen=True)
class _Exit:
    """The step in which a piece is left, time from its start [s], angle there, side; 0: it turns."""

    step: int
    after: float
    angle: float
    side: int


def gear_path(
    spacing: float, torque: np.ndarray, law: GearLaw, damping: float, start: float
) -> GearPath:
    """Return the path of one gear under d e' + S(e) + sum h_j = T(t).

    Args:
        spacing: Time between samples [s].
        torque: Coefficients of 1, s, s^2, s^3 in T in each interval [N m], (n - 1, 4).
        law: S and elements, unloaded.
        damping: d [N m s/rad], > 0.
        start: e at the first sample [rad], to which it came from unloaded.
    """
    count = len(torque)
    turns = _turns(torque, spacing)
    angle, carried, slope = np.empty((3, count + 1))
    pieces = law.pieces
    now = _first_piece(pieces, start, torque[0])
    row, offset, x = 0, 0.0, start
    angle[0], carried[0] = start, pieces[now].torque_at(start)
    slope[0] = pieces[now].slope(np.array(start))
    entered, visited = [0.0], [pieces[now]]
    many = _FIRST
    while row < count:
        piece = pieces[now]
        end = min(row + many, count)
        steps = _steps(spacing, torque, row, offset, end)
        if piece.straight:
            ends = follow_line(piece, damping, x, steps)
        else:
            if many == _FIRST:
                steps = _graded(steps, damping / piece.slopes[1])
            steps, ends = follow_bend(piece, damping, x, steps)
        exit_ = _first_exit(piece, damping, x, ends, steps, turns)
        good = len(ends) if exit_ is None else exit_.step
        at = np.flatnonzero(steps.last[:good])
        samples, reached = steps.row[at] + 1, ends[at]
        angle[samples] = reached
        carried[samples], slope[samples] = piece.torque(reached), piece.slope(reached)
        if exit_ is None:
            row, offset, x = int(steps.row[-1]), 0.0, float(ends[-1])
            if steps.last[-1]:
                row += 1
            else:
                offset = float(steps.offset[-1] + steps.length[-1])
            many = min(2 * many, _MOST_STRAIGHT if piece.straight else _MOST_BENT)
            continue
        row = int(steps.row[exit_.step])
        offset = float(steps.offset[exit_.step]) + exit_.after
        x, many = exit_.angle, _FIRST
        if exit_.side == 0:
            law = law.turned(x)
            x, pieces = law.angle, law.pieces
            now = _turned_piece(pieces, x, -piece.slips)
        else:
            now += exit_.side
        entered.append(row * spacing + offset)
        visited.append(pieces[now])
    return GearPath(angle, carried, slope, entered, visited)


def _first_piece(pieces: tuple[Piece, ...], start: float, torque: np.ndarray) -> int:
    """Return the piece that holds at first; on an end shared by two the one the gear moves into.

    At rest there, with a torque that does not move it, it stays with the piece outside the backlash.
    """
    near = [k for k, p in enumerate(pieces) if p.low - _SLACK <= start <= p.high + _SLACK]
    if len(near) == 1:
        return near[0]
    pull = torque - np.array([pieces[near[0]].torque_at(start), 0.0, 0.0, 0.0])
    moving = np.flatnonzero(pull)
    if len(moving):
        return near[int(pull[moving[0]] > 0.0)]
    return next(k for k in near if not pieces[k].in_backlash)


def _turned_piece(pieces: tuple[Piece, ...], start: float, way: int) -> int:
    """Return the piece that a gear moves into from where it turns, up (1) or down (-1)."""
    if way > 0:
        return next(k for k, piece in enumerate(pieces) if piece.high > start)
    return max(k for k, piece in enumerate(pieces) if piece.low < start)


def _turns(torque: np.ndarray, spacing: float) -> np.ndarray:
    """Whether T' may change its sign inside an interval (n - 1,), by its Bernstein coefficients."""
    c1, c2, c3 = torque[:, 1], torque[:, 2] * spacing, torque[:, 3] * spacing**2
    rates = np.stack([c1, c1 + c2, c1 + 2.0 * c2 + 3.0 * c3])
    turns: np.ndarray = (rates.min(axis=0) < 0.0) & (rates.max(axis=0) > 0.0)
    return turns


def _steps(spacing: float, torque: np.ndarray, row: int, offset: float, end: int) -> Steps:
    """Return one step per interval up to `end`, the first one from `offset` on."""
    rows = np.arange(row, end)
    offsets, lengths = np.zeros(len(rows)), np.full(len(rows), spacing)
    offsets[0], lengths[0] = offset, max(spacing - offset, 0.0)
    local = torque[row:end]
    if offset > 0.0:
        local = local.copy()
        local[0] = shifted(local[0], offset)
    return Steps(rows, offsets, lengths, local, np.ones(len(rows), dtype=bool))


def _graded(steps: Steps, shortest: float) -> Steps:
    """Halve the first steps down to a part of the shortest time constant, growing from there."""
    for _ in range(60):
        begins = np.cumsum(steps.length) - steps.length
        wide = steps.length > _FIRST_STEP * shortest + (_GROWTH - 1.0) * begins
        if not wide.any() or begins[np.argmax(wide)] > 20.0 * shortest:
            return steps
        wide &= begins <= 20.0 * shortest
        steps = steps.halved(wide)
    return steps


def _first_exit(
    piece: Piece, damping: float, start: float, ends: np.ndarray, steps: Steps, turns: np.ndarray
) -> _Exit | None:
    """Return the first exit of the angle from the piece, or its reversal where an element slips.

    Between the ends of steps too.

    e' = v obeys d v' + S'(e) v = T', so v passes zero only in the direction of T': where T' keeps its
    sign and v is of one sign at both ends, e is monotone and its ends are its extremes.
    """
    if np.isinf(piece.low) and np.isinf(piece.high):
        return None
    slack = _slack(piece)
    begins = np.append(start, ends[:-1])
    outside = (ends > piece.high + slack) | (ends < piece.low - slack)
    beyond = int(np.argmax(outside)) + 1 if outside.any() else len(ends)
    begins, ends = begins[:beyond], ends[:beyond]
    h, c = steps.length[:beyond], steps.torque[:beyond]
    slow = np.abs(c[:, 1]) + h * (2.0 * np.abs(c[:, 2]) + 3.0 * h * np.abs(c[:, 3]))
    v_0 = (c[:, 0] - piece.torque(begins)) / damping
    v_1 = (c[:, 0] + h * (c[:, 1] + h * (c[:, 2] + h * c[:, 3])) - piece.torque(ends)) / damping
    # |v| <= |v_0| + h max |T'| / d, and on a flank also <= max(|v_0|, max |T'| / min S').
    fastest = np.abs(v_0) + h * slow / damping
    if piece.slopes[0] > 0.0:
        fastest = np.minimum(fastest, np.maximum(np.abs(v_0), slow / piece.slopes[0]))
    reach = h * fastest
    near = (np.minimum(begins, ends) - reach < piece.low - slack) | (
        np.maximum(begins, ends) + reach > piece.high + slack
    )
    suspect = near & (turns[steps.row[:beyond]] | (v_0 * v_1 < 0.0))
    suspect |= outside[:beyond]
    if piece.slips:
        suspect |= turns[steps.row[:beyond]] | (
            np.minimum(piece.slips * v_0, piece.slips * v_1) < 0.0
        )
    for k in np.flatnonzero(suspect):
        found = _exit_in_step(piece, damping, float(begins[k]), float(ends[k]), float(h[k]), c[k])
        if found is not None:
            return _Exit(int(k), *found)
    return None


def _slack(piece: Piece) -> float:
    return _SLACK if piece.straight else _SLACK_BENT


def _exit_in_step(
    piece: Piece, damping: float, start: float, end: float, length: float, torque: np.ndarray
) -> tuple[float, float, int] | None:
    """Return time, angle and side (-1, 1; 0: it turns) at which one step leaves the piece, or None."""
    c0, c1, c2, c3 = torque.tolist()
    slack = _slack(piece)
    along = _along(piece, damping, start, torque)

    def angle(s: float) -> float:
        if s <= 0.0:
            return start
        return end if s >= length else along(s)

    def rate(s: float) -> float:
        pull = c0 + s * (c1 + s * (c2 + s * c3))
        return (pull - piece.torque_at(angle(s))) / damping

    turning = [s for s in _quadratic_roots(3.0 * c3, 2.0 * c2, c1) if 0.0 < s < length]
    times = [0.0, *sorted(turning), length]
    points = [times[0]]
    for a, b in itertools.pairwise(times):
        if rate(a) * rate(b) < 0.0:
            points.append(brentq(rate, a, b, xtol=1e-16 * length, rtol=1e-14))
        points.append(b)
    for a, b in itertools.pairwise(points):
        x = angle(b)
        if piece.slips * (x - angle(a)) < -slack:
            return a, angle(a), 0
        side = 1 if x > piece.high + slack else -1 if x < piece.low - slack else 0
        if side == 0:
            continue
        edge = piece.high if side > 0 else piece.low
        if (angle(a) - edge) * side >= 0.0:
            return a, angle(a), side
        s = brentq(lambda s, edge=edge: angle(s) - edge, a, b, xtol=1e-16 * length, rtol=1e-14)
        return s, edge, side
    return None


def _along(
    piece: Piece, damping: float, start: float, torque: np.ndarray
) -> Callable[[float], float]:
    """Return the angle as a function of the time from a step's start."""
    if not piece.straight:

        def bent(s: float) -> float:
            one = np.zeros(1)
            step = Steps(one.astype(int), one, np.array([s]), torque[None], one == 0.0)
            values, _ = collocate(piece, damping, step, np.full((1, 5), start))
            return float(values[0, -1])

        return bent
    c0, c1, c2, c3 = torque.tolist()
    c0 -= piece.torque_at(start)

    def straight(s: float) -> float:
        w0, w1, w2, w3 = line_weights(piece.cubic[1], damping, s)
        return start + w0 * c0 + w1 * c1 + w2 * c2 + w3 * c3

    return straight


def _quadratic_roots(a: float, b: float, c: float) -> list[float]:
    """Real roots of a s^2 + b s + c, without cancellation."""
    inner = b * b - 4.0 * a * c
    if inner < 0.0:
        return []
    q = -0.5 * (b + math.copysign(math.sqrt(inner), b))
    return [*([q / a] if a != 0.0 else []), *([c / q] if q != 0.0 else [])]
