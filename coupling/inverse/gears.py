"""Wind-up of the gears of a moving robot under the torque that its links need.

The torque T that a gear passes on stretches its spring and its damper,

    d e' + S(e) + H = T(t),   e(0) given,                                                       (1)

the row of a gear in the equation of motion of [Flexible2008], with T = -(M theta'' + h - J^T w) and the
torque H of the elements of its hysteresis.

Without elements the distance of two solutions e_1 > e_2 under one T never grows, for S is continuous and
rises: d (e_1 - e_2)' = -(S(e_1) - S(e_2)) <= 0.  Hence one answer to each start, errors that die out on
a flank and stay as they are in the backlash, and no chatter.  In the backlash e' = T / d: a gear crosses
it, from flank to flank, when the integral of T has grown by 2 B d; where it arrives e'' jumps by
-S' e' / d.  With elements of elongation s_j, k (e_1 - e_2)^2 + sum f_j (s_1j - s_2j)^2 / a_j never
grows, where S is a line.

Gears do not depend on each other.  Each is followed from piece to piece of its curve, which is another
one where elements turn back (`gear_elements`): lines by the exact solution under cubic torque, many
samples at once, bends by implicit steps under error control; between samples too, the time at which a
piece is left is solved for.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
from scipy.interpolate import CubicSpline

from coupling.inverse.gear_elements import GearElements, GearLaw
from coupling.inverse.gear_path import GearPath, gear_path
from coupling.inverse.gear_pieces import Piece, pieces_of
from elastic_robot.chain import Chain
from elastic_robot.parameters import Parameters
from elastic_robot.torque_curves import TorqueCurve

# Time constant d / k of a gear that is given no damper [s], where it needs one.  Its crossings then
# take sqrt(4 B d / T') under a torque that grows by T' a second: 4 ms at B = 1 mrad, T' = k 25 mrad/s,
# one cycle of a controller; and its wind-up on a flank lags by 0.1 ms, 0.1 urad at 1 mrad/s.
SHORTEST_TIME_CONSTANT = 1e-4

# Smallest slope, by the steepest one, of a curve that can be inverted point by point.
_RISING = 1e-6


@dataclass(frozen=True)
class Crossing:
    """A gear crosses its backlash, or leaves a flank and comes back to it.

    Attributes:
        gear: Number among the gears, from 0.
        begins: Time at which it leaves the flank, or the first time [s].
        ends: Time at which it reaches a flank, or the last time [s].
        side_before: Flank it leaves, -1 or 1; 0 if it is in its backlash at the first time.
        side_after: Flank it reaches, -1 or 1; 0 if it is in its backlash at the last time.
    """

    gear: int
    begins: float
    ends: float
    side_before: int
    side_after: int


@dataclass(frozen=True)
class WindUp:
    """Motion of the gears.

    Attributes:
        time: Times [s], (n,).
        angle: Wind-up e [rad], (n, gears).
        rate: e' [rad/s], (n, gears).
        acceleration: e'' [rad/s^2], (n, gears); where it jumps, that of one of both sides.
        crossings: Passages through the backlash, by gear and time.
    """

    time: np.ndarray
    angle: np.ndarray
    rate: np.ndarray
    acceleration: np.ndarray
    crossings: tuple[Crossing, ...]


def gears_of(parameters: Parameters, chain: Chain) -> Parameters:
    """Return the parameters of the gears alone, in the order of `chain.torsions`.

    Args:
        parameters: Parameters of all elastic coordinates.
        chain: The robot's chain.
    """
    return rows_of(parameters, chain.torsions)


def rows_of(parameters: Parameters, rows: np.ndarray) -> Parameters:
    """Return the parameters of some elastic coordinates alone, by their numbers, (k,)."""
    return replace(
        parameters,
        stiffness=parameters.stiffness[rows],
        damping=parameters.damping[rows],
        backlash=parameters.backlash[rows],
        hysteresis=parameters.hysteresis[rows],
        tables=tuple(parameters.tables[k] for k in rows),
    )


def damping_in_backlash(
    curve: TorqueCurve, damping: np.ndarray, elements: tuple[GearElements, ...] = ()
) -> np.ndarray:
    """Return the damping that `solve_wind_up` uses [N m s/rad], (gears,): that given, if there is any.

    A gear without damper follows its torque at once, e = S^-1(T): no damper is needed where S rises
    strictly.  In a backlash S^-1 has no answer, where S is level e' is infinite, and with elements e
    depends on its way: such a gear gets a damper with the time constant `SHORTEST_TIME_CONSTANT` on the
    steepest flank of S.
    """
    used = np.array(damping, dtype=float)
    for gear in np.flatnonzero(used == 0.0):
        low, high = _slopes(pieces_of(curve, int(gear)))
        if low < _RISING * high or (elements and elements[gear].count):
            used[gear] = SHORTEST_TIME_CONSTANT * high
    return used


def solve_wind_up(
    time: np.ndarray,
    torque: np.ndarray,
    curve: TorqueCurve,
    damping: np.ndarray,
    start: np.ndarray,
    elements: tuple[GearElements, ...] = (),
) -> WindUp:
    """Solve eq. (1) for all gears.

    Args:
        time: Evenly spaced times [s], (n,), n >= 4.
        torque: T of each gear [N m], (n, gears); between the times its cubic spline, not-a-knot at
            the ends: third order where the torque does not begin at rest, too.
        curve: Torque curve S of the gears alone.
        damping: d [N m s/rad], (gears,), >= 0; see `damping_in_backlash` for 0.
        start: e at the first time [rad], (gears,), to which elements came from unloaded; not used by a
            gear without damper that needs none.
        elements: Elements of the hysteresis of each gear, (gears,); none: no gear has any.

    Raises:
        ValueError: If times are not evenly spaced, shapes do not fit or values are not finite.

    Example:
        >>> from elastic_robot.torque_curves import BacklashCurve
        >>> time = np.linspace(0.0, 1.0, 1001)
        >>> curve = BacklashCurve(np.array([1e4]), np.array([1e-3]))
        >>> torque = 20.0 - 40.0 * time[:, None]
        >>> wind_up = solve_wind_up(time, torque, curve, np.array([5.0]), np.array([3e-3]))
        >>> [(round(c.begins, 4), round(c.ends, 4), c.side_after) for c in wind_up.crossings]
        [(0.5005, 0.5224, -1)]
    """
    time, torque, damping, start = _checked(time, torque, curve, damping, start)
    spacing = float((time[-1] - time[0]) / (len(time) - 1))
    used = damping_in_backlash(curve, damping, elements)
    angle, rate, acceleration = np.empty((3, *torque.shape))
    crossings: list[Crossing] = []
    for gear in range(torque.shape[1]):
        pieces = pieces_of(curve, gear)
        spline = CubicSpline(time, torque[:, gear])
        cubic = np.ascontiguousarray(spline.c[::-1].T)
        pull, pull_rate = torque[:, gear], np.append(cubic[:, 1], spline(time[-1], 1))
        d = float(used[gear])
        if d == 0.0:
            motion = _without_damper(pieces, pull, pull_rate, spline(time, 2))
        else:
            law = GearLaw(pieces, elements[gear]) if elements else GearLaw(pieces)
            path = gear_path(spacing, cubic, law, d, float(start[gear]))
            v = (pull - path.torque) / d
            motion = path.angle, v, (pull_rate - path.slope * v) / d
            crossings += _crossings(gear, path, time)
        angle[:, gear], rate[:, gear], acceleration[:, gear] = motion
    return WindUp(time, angle, rate, acceleration, tuple(crossings))


def _crossings(gear: int, path: GearPath, time: np.ndarray) -> list[Crossing]:
    """Return the visits of the backlash; reversals of elements inside it end none."""
    found = []
    visited, most = path.visited, len(path.visited)
    inside = np.array([False, *(piece.in_backlash for piece in visited), False])
    change = np.diff(inside.astype(int))
    for k, behind in zip(np.flatnonzero(change > 0), np.flatnonzero(change < 0), strict=True):
        begins = float(time[0]) + path.entered[k]
        ends = float(time[-1]) if behind == most else float(time[0]) + path.entered[behind]
        before = 0 if k == 0 else 1 if visited[k - 1].low >= visited[k].high else -1
        after = (
            0 if behind == most else 1 if visited[behind].low >= visited[behind - 1].high else -1
        )
        found.append(Crossing(gear, begins, ends, before, after))
    return found


def _slopes(pieces: tuple[Piece, ...]) -> tuple[float, float]:
    return min(p.slopes[0] for p in pieces), max(p.slopes[1] for p in pieces)


def static_wind_up(law: GearLaw, torque: float) -> float:
    """Return the wind-up of a gear at rest under a torque [N m], from unloaded [rad]."""
    ends = [piece.torque_at(piece.high) for piece in law.pieces[:-1]]
    piece = law.pieces[int(np.searchsorted(ends, torque))]
    return float(_inverse(piece, np.array([torque]))[0])


def _without_damper(
    pieces: tuple[Piece, ...], pull: np.ndarray, pull_rate: np.ndarray, pull_bend: np.ndarray
) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Return e = S^-1(T), e' and e'' from T, T' and T'', (n,) each."""
    torques = np.array([p.torque_at(p.high) for p in pieces[:-1]])
    number = np.searchsorted(torques, pull)
    e, v, a = np.empty((3, len(pull)))
    for k, piece in enumerate(pieces):
        here = number == k
        e[here] = _inverse(piece, pull[here])
        slope = piece.slope(e[here])
        v[here] = pull_rate[here] / slope
        a[here] = (pull_bend[here] - piece.curvature(e[here]) * v[here] ** 2) / slope
    return e, v, a


def _inverse(piece: Piece, torque: np.ndarray) -> np.ndarray:
    """Return the angles at which a piece that rises strictly carries torques, (k,)."""
    if piece.straight:
        return piece.origin + (torque - piece.cubic[0]) / piece.cubic[1]
    low, high = np.full(len(torque), piece.low), np.full(len(torque), piece.high)
    x = 0.5 * (low + high)
    for _ in range(60):
        excess = piece.torque(x) - torque
        high, low = np.where(excess > 0.0, x, high), np.where(excess > 0.0, low, x)
        newton = x - excess / piece.slope(x)
        # Newton's step where it stays between the bounds, else their middle.
        new = np.where((newton >= low) & (newton <= high), newton, 0.5 * (low + high))
        if np.all(np.abs(new - x) <= 4e-16 * np.abs(x)):
            return new
        x = new
    return x


def _checked(
    time: np.ndarray, torque: np.ndarray, curve: TorqueCurve, damping: np.ndarray, start: np.ndarray
) -> tuple[np.ndarray, ...]:
    time, torque, damping, start = (
        np.asarray(v, dtype=float) for v in (time, torque, damping, start)
    )
    gears = len(curve.half_width)
    shapes = torque.shape, damping.shape, start.shape
    expected = (len(time), gears), (gears,), (gears,)
    if shapes != expected:
        raise ValueError(f"torque, damping and start: expected shapes {expected}, got {shapes}")
    if len(time) < 4:
        raise ValueError(f"time: expected at least 4 samples, got {len(time)}: give more of them")
    for name, values in (("time", time), ("torque", torque), ("start", start)):
        if not np.isfinite(values).all():
            raise ValueError(f"{name}: expected finite numbers, got others: look for NaN in it")
    if not (np.isfinite(damping).all() and (damping >= 0.0).all()):
        raise ValueError(
            f"damping: expected finite numbers >= 0 [N m s/rad], got {damping.tolist()}"
        )
    steps = np.diff(time)
    mean = (time[-1] - time[0]) / (len(time) - 1)
    if mean <= 0.0 or np.abs(steps - mean).max() > 1e-6 * mean:
        raise ValueError(
            "time: expected evenly spaced times, got steps from"
            f" {steps.min():.9g} to {steps.max():.9g} s: interpolate to an even grid"
        )
    return time, torque, damping, start
