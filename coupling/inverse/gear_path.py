"""One gear along its whole path: from piece to piece of its law, a polyline, in closed form.

A law is the torque of a gear's spring and its elements over the wind-up from a place of its path on,

    S(e) + sum_j f_j clip((s_j + e - e_0) / a_j, +-1)        (`elastic_robot.hysteresis`),

until e turns back where an element slips: from there on it is another one.  Springs that bend are
taken for chords.  With the torque T straight between samples and S a line of slope k, l = k / d, v = e',

    e = e_0 + v_0 psi_1 + T' psi_2 / d,   psi_1 = (1 - exp(-l t)) / l,   psi_2 = (t - psi_1) / l.
"""

from __future__ import annotations

from bisect import bisect_right
from dataclasses import dataclass
from functools import cached_property

import numpy as np
from scipy.optimize import brentq

from coupling.inverse.gear_elements import NO_ELEMENTS, GearElements
from coupling.inverse.recursion import recursion
from elastic_robot.torque_curves import TorqueCurve

# Chords of a spring that bends, between two of its knots.
_CHORDS = 64
# Narrowest piece [rad]: far above rounding, worth micronewton metres.
_NARROW = 1e-12
# Changes of piece within a sample, beyond which the gear is taken to rest where it is.
_MOST_CHANGES = 500
# Pieces that are few enough for a gear to stay in each, samples in one after which the next ones are
# looked at together, and how many of these at first.
_FEW, _STAYS, _AT_ONCE = 3, 8, 64


@dataclass(frozen=True)
class GearLaw:
    """Torque of one gear, a polyline.

    Attributes:
        angle: Angles at its corners, rising [rad], (m,).
        torque: Torque there [N m], (m,).
        slope: Slope of each piece, the outer ones endless [N m/rad], (m + 1,).
    """

    angle: np.ndarray
    torque: np.ndarray
    slope: np.ndarray

    @classmethod
    def of(cls, curve: TorqueCurve, gear: int) -> GearLaw:
        """Return the law of a gear's spring, by its number in a curve of all gears.

        Example:
            >>> from elastic_robot.torque_curves import BacklashCurve
            >>> GearLaw.of(BacklashCurve(np.array([1e4]), np.array([1e-3])), 0).slope
            array([10000.,     0., 10000.])
        """
        bends = curve.bend_angles[gear]
        angle = bends[np.isfinite(bends)]
        if not len(angle):
            angle = np.zeros(1)
        elif curve.bends[gear]:
            part = np.arange(_CHORDS * (len(angle) - 1) + 1) / _CHORDS
            angle = np.interp(part, np.arange(len(angle)), angle)
        # The outer slopes are those of its ends.
        ends = np.concatenate([[angle[0] - 1.0], angle, [angle[-1] + 1.0]])
        every = np.zeros((len(ends), len(curve.half_width)))
        every[:, gear] = ends
        torque = curve.torque(every)[:, gear]
        return cls(angle, torque[1:-1], np.diff(torque) / np.diff(ends))

    @property
    def backlash(self) -> tuple[float, float]:
        """Ends of the angles at which it has no torque [rad]; equal where it has no backlash."""
        free = self.angle[self.torque == 0.0]
        return (float(free[0]), float(free[-1])) if len(free) else (0.0, 0.0)

    def at(self, angle: np.ndarray) -> np.ndarray:
        """Return the torque at angles [N m], shape of these."""
        piece = np.searchsorted(self.angle, angle)
        corner = np.maximum(piece - 1, 0)
        torque: np.ndarray = self.torque[corner] + self.slope[piece] * (angle - self.angle[corner])
        return torque

    def angle_at(self, torque: float) -> float:
        """Return an angle at which it carries a torque [N m], where it rises [rad]."""
        piece = int(np.searchsorted(self.torque, torque))
        corner = max(piece - 1, 0)
        return float(self.angle[corner] + (torque - self.torque[corner]) / self.slope[piece])

    def with_elements(
        self, elements: GearElements, start: float, elongation: np.ndarray
    ) -> GearLaw:
        """Return the law of a spring beside elements, until one that slips turns back.

        Args:
            elements: The elements.
            start: Wind-up from which on they are followed [rad].
            elongation: Their elongations there [rad], (e,).
        """
        a, rest = elements.slip_angle, start - elongation
        angle = np.sort(np.concatenate([self.angle, rest + a, rest - a]))
        angle = angle[np.append(True, np.diff(angle) > _NARROW)]
        ends = np.concatenate([[angle[0] - 1.0], angle, [angle[-1] + 1.0]])
        torque = self.at(ends) + elements.torque(np.clip(ends[:, None] - rest, -a, a))
        return GearLaw(angle, torque[1:-1], np.diff(torque) / np.diff(ends))


@dataclass(frozen=True)
class _Pieces:
    """The pieces of a law as plain numbers, with the weights of a whole step."""

    law: GearLaw
    damping: float
    spacing: float

    @cached_property
    def corners(self) -> list[float]:
        return [*self.law.angle.tolist(), np.inf, -np.inf]  # the last one ends piece 0 below

    @cached_property
    def slopes(self) -> list[float]:
        return self.law.slope.tolist()

    @cached_property
    def offsets(self) -> list[float]:
        corner = np.maximum(np.arange(len(self.law.slope)) - 1, 0)
        offsets: list[float] = (
            self.law.torque[corner] - self.law.slope * self.law.angle[corner]
        ).tolist()
        return offsets

    @cached_property
    def weights(self) -> list[tuple[float, float]]:
        return [self.after(slope, self.spacing) for slope in self.slopes]

    def after(self, slope: float, time: float) -> tuple[float, float]:
        """Return psi_1 [s] and psi_2 [s^2] of a piece."""
        rate = slope / self.damping
        if rate * time < 1e-4:
            return time * (1.0 - 0.5 * rate * time), time * time * (0.5 - rate * time / 6.0)
        first = -np.expm1(-rate * time) / rate
        return float(first), float((time - first) / rate)


def gear_path(
    spacing: float,
    torque: np.ndarray,
    spring: GearLaw,
    damping: float,
    start: float,
    elements: GearElements = NO_ELEMENTS,
) -> tuple[np.ndarray, np.ndarray]:
    """Return the wind-up [rad] and its rate [rad/s] of one gear at samples, (n,) each.

    Args:
        spacing: Time between samples [s].
        torque: T at the samples [N m], (n,), straight in between.
        spring: S.
        damping: d [N m s/rad], > 0.
        start: e at the first sample [rad], to which the elements came from unloaded.
        elements: Elements of its hysteresis.
    """
    elongation = np.clip(start, -elements.slip_angle, elements.slip_angle)
    turned, way, slips = start, 0.0, bool(elements.count)
    law = spring.with_elements(elements, start, elongation) if slips else spring
    pieces = _Pieces(law, damping, spacing)
    e, pulls = start, torque.tolist()
    now = _piece_of(pieces, e, pulls)
    angles, rates = np.empty((2, len(pulls)))
    angles[0] = e
    rates[0] = (pulls[0] - pieces.offsets[now] - pieces.slopes[now] * e) / damping
    k, stays, most = 1, 0, _AT_ONCE
    seldom = not slips and len(pieces.slopes) <= _FEW
    while k < len(pulls):
        if stays >= _STAYS:
            ahead = _within(pieces, e, now, torque[k - 1 : k + most])
            until = k + len(ahead)
            angles[k:until] = ahead
            rates[k:until] = torque[k:until] - pieces.offsets[now] - pieces.slopes[now] * ahead
            rates[k:until] /= damping
            stays, most = (stays, 2 * most) if len(ahead) == most else (0, _AT_ONCE)
            k, e = until, float(angles[until - 1])
            continue
        before, piece = e, now
        e, now = _step(pieces, e, now, pulls[k - 1], pulls[k])
        stays = stays + 1 if seldom and now == piece else 0
        if slips and (e - before) * way < 0.0:
            # What it was until it turned, and once more from there.
            a = elements.slip_angle
            elongation = np.clip(elongation + before - turned, -a, a)
            turned = before
            pieces = _Pieces(spring.with_elements(elements, turned, elongation), damping, spacing)
            piece = _piece_of(pieces, turned, pulls[k - 1 :])
            e, now = _step(pieces, turned, piece, pulls[k - 1], pulls[k])
        way = e - before or way
        angles[k] = e
        rates[k] = (pulls[k] - pieces.offsets[now] - pieces.slopes[now] * e) / damping
        k += 1
    return angles, rates


def _within(pieces: _Pieces, angle: float, piece: int, torque: np.ndarray) -> np.ndarray:
    """Return the angles from the next sample on, as long as the gear stays in its piece, (n,).

    Args:
        angle: Angle now [rad].
        torque: T now and at the next samples [N m], (k,).
    """
    (first, second), d = pieces.weights[piece], pieces.damping
    pushed = (torque[:-1] - pieces.offsets[piece]) * (first / d)
    pushed += np.diff(torque) * (second / (pieces.spacing * d))
    keeps = 1.0 - pieces.slopes[piece] * first / d
    angles = recursion(pushed, keeps, angle)
    leaves = (angles < pieces.corners[piece - 1]) | (angles > pieces.corners[piece])
    stays: np.ndarray = angles[: np.argmax(leaves)] if leaves.any() else angles
    return stays


def _piece_of(pieces: _Pieces, angle: float, pulls: list[float]) -> int:
    """Return the piece at an angle; on a corner that into which the gear moves, at rest the upper."""
    count = len(pieces.slopes) - 1
    piece = bisect_right(pieces.corners, angle, 0, count)
    if piece and angle == pieces.corners[piece - 1]:
        torque = float(pieces.law.torque[piece - 1])
        moves = next((pull - torque for pull in pulls[:2] if pull != torque), 0.0)
        return piece if moves >= 0.0 else piece - 1
    return piece


def _step(pieces: _Pieces, angle: float, piece: int, pull: float, then: float) -> tuple[float, int]:
    """Return the angle a sample later, and its piece, from those now and the torques at both."""
    corners, slopes, offsets, d = pieces.corners, pieces.slopes, pieces.offsets, pieces.damping
    left, rate = pieces.spacing, (then - pull) / (pieces.spacing * d)
    first, second = pieces.weights[piece]
    for _ in range(_MOST_CHANGES):
        speed = (pull - offsets[piece] - slopes[piece] * angle) / d
        new = angle + speed * first + rate * second
        low, high = corners[piece - 1], corners[piece]
        if low <= new <= high:
            return new, piece
        edge = high if new > high else low
        gone = _until(pieces, slopes[piece], (angle - edge, speed, rate), left, new - edge)
        left, pull, angle = left - gone, pull + rate * d * gone, edge
        piece += 1 if new > high else -1
        first, second = pieces.after(slopes[piece], left)
    return angle, piece


def _until(
    pieces: _Pieces, slope: float, motion: tuple[float, float, float], left: float, last: float
) -> float:
    """Return when an angle comes to zero that is off it, `motion`, now, and `last` after a time."""
    off, speed, rate = motion

    def away(time: float) -> float:
        first, second = pieces.after(slope, time)
        return off + speed * first + rate * second

    # Zero already, and on its way away from it.
    return 0.0 if off * last >= 0.0 else float(brentq(away, 0.0, left))
