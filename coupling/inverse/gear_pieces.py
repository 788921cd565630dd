"""The torque curve of one gear, cut into pieces that are polynomials."""

from __future__ import annotations

import itertools
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np

from elastic_robot.spline_curve import SplineCurve
from elastic_robot.torque_curves import TorqueCurve

# What a coefficient adds to the torque over its piece, relative to the steepest line over it:
# below this it is the rounding of an interpolation.
_ROUNDING = 1e-12


@dataclass(frozen=True)
class Piece:
    """Torque of a gear between two angles, a cubic that rises; beyond them its tangents.

    Attributes:
        low: Angle at which the piece begins [rad], may be -infinity.
        high: Angle at which it ends [rad], may be infinity.
        origin: Angle from which the cubic counts [rad].
        cubic: Coefficients 1, t, t^2, t^3 of the torque [N m], (4,).
        in_backlash: Whether the gear turns here without torque of its spring.
        slips: 1 where an element of the hysteresis slips on the way up, -1 on the way down, else 0.

    Example:
        >>> flank = Piece(1e-3, np.inf, 1e-3, (0.0, 1e4, 0.0, 0.0))
        >>> flank.torque(np.array([3e-3])), flank.straight, flank.in_backlash
        (array([20.]), True, False)
    """

    low: float
    high: float
    origin: float
    cubic: tuple[float, float, float, float]
    in_backlash: bool = False
    slips: int = 0

    @property
    def straight(self) -> bool:
        """Whether the torque is a line."""
        return self.cubic[2] == 0.0 and self.cubic[3] == 0.0

    @cached_property
    def slopes(self) -> tuple[float, float]:
        """Smallest and largest slope [N m/rad]; a quadratic has them at its ends or its vertex."""
        if self.straight:
            return self.cubic[1], self.cubic[1]
        _, c1, c2, c3 = self.cubic
        ends = np.array([self.low, self.high]) - self.origin
        vertex = np.clip(-c2 / (3.0 * c3), *ends) if c3 != 0.0 else ends[0]
        t = np.append(ends, vertex)
        slope = np.maximum(c1 + t * (2.0 * c2 + 3.0 * t * c3), 0.0)
        return float(slope.min()), float(slope.max())

    def torque(self, x: np.ndarray) -> np.ndarray:
        """S(x) [N m], shape of x."""
        c0, c1, c2, c3 = self.cubic
        if self.straight:
            return c0 + c1 * (x - self.origin)
        inside = np.clip(x, self.low, self.high)
        t = inside - self.origin
        return c0 + t * (c1 + t * (c2 + t * c3)) + self._slope(t) * (x - inside)

    def torque_at(self, x: float) -> float:
        """S(x) [N m] of one angle."""
        if self.straight:
            return self.cubic[0] + self.cubic[1] * (x - self.origin)
        return float(self.torque(np.array(x)))

    def slope(self, x: np.ndarray) -> np.ndarray:
        """dS/dx [N m/rad], >= 0, shape of x."""
        if self.straight:
            return np.full(np.shape(x), self.cubic[1])
        return self._slope(np.clip(x, self.low, self.high) - self.origin)

    def curvature(self, x: np.ndarray) -> np.ndarray:
        """d2S/dx2 [N m/rad^2], shape of x."""
        return 2.0 * self.cubic[2] + 6.0 * self.cubic[3] * (x - self.origin)

    def _slope(self, t: np.ndarray) -> np.ndarray:
        _, c1, c2, c3 = self.cubic
        return np.maximum(c1 + t * (2.0 * c2 + 3.0 * t * c3), 0.0)


def pieces_of(curve: TorqueCurve, gear: int) -> tuple[Piece, ...]:
    """Return the pieces of a gear's curve by rising angle; each begins where the one before ends.

    Neighbours on one cubic are one piece: all of a backlash, and all of a flank.

    Args:
        curve: Torque curve of all gears.
        gear: Index of the gear.
    """
    raw = _of_spline(curve, gear) if isinstance(curve, SplineCurve) else _of_lines(curve, gear)
    pieces = raw[:1]
    for piece in raw[1:]:
        last = pieces[-1]
        if _on_one_cubic(last, piece):
            pieces[-1] = replace(last, high=piece.high)
        else:
            pieces.append(piece)
    free = (0.0, 0.0, 0.0, 0.0)
    return tuple(replace(piece, in_backlash=piece.cubic == free) for piece in pieces)


def _of_lines(curve: TorqueCurve, gear: int) -> list[Piece]:
    """Flank, backlash and flank, or one line."""
    half_width = float(curve.half_width[gear])
    count = len(curve.half_width)

    def line(low: float, high: float, origin: float, region: int) -> Piece:
        branch = curve.in_region(np.full(count, region))
        at = np.zeros(count)
        at[gear] = origin
        slope = float(branch.slope(at)[gear])
        # The branches meet at the backlash's edges without torque.
        return Piece(low, high, origin, (0.0, slope, 0.0, 0.0))

    if np.isinf(half_width):
        return [line(-np.inf, np.inf, 0.0, 1)]
    return [
        line(-np.inf, -half_width, -half_width, -1),
        line(-half_width, half_width, 0.0, 0),
        line(half_width, np.inf, half_width, 1),
    ]


def _of_spline(curve: SplineCurve, gear: int) -> list[Piece]:
    knots = curve.knots[gear]
    ends = np.concatenate([[-np.inf], knots[np.isfinite(knots)], [np.inf]])
    steepest = float(np.max(curve.cubics[gear, : len(ends) - 1, 1]))
    pieces = []
    for number, (low, high) in enumerate(itertools.pairwise(ends)):
        cubic = curve.cubics[gear, number].copy()
        if np.isfinite(low) and np.isfinite(high):
            width = high - low
            small = np.abs(cubic) * width ** np.arange(4) < _ROUNDING * steepest * width
            # A line only as a whole: one small coefficient of a bent piece stays.
            small[2:] = small[2:].all()
            cubic[small] = 0.0
        else:
            cubic[2:] = 0.0
        c0, c1, c2, c3 = (float(c) for c in cubic)
        origin = float(curve.origins[gear, number])
        pieces.append(Piece(float(low), float(high), origin, (c0, c1, c2, c3)))
    return pieces


def _on_one_cubic(a: Piece, b: Piece) -> bool:
    """Whether b continues the cubic of a."""
    t = b.origin - a.origin
    c0, c1, c2, c3 = a.cubic
    moved = (
        c0 + t * (c1 + t * (c2 + t * c3)),
        c1 + t * (2.0 * c2 + 3.0 * t * c3),
        c2 + 3.0 * t * c3,
        c3,
    )
    finite = [w for w in (a.high - a.low, b.high - b.low, abs(t)) if 0.0 < w < np.inf]
    width = max(finite, default=0.0)
    apart = np.abs(np.subtract(moved, b.cubic)) * width ** np.arange(4)
    # A line that goes on for ever goes on only as a line.
    same_kind = a.straight == b.straight
    steepest = max(a.slopes[1], b.slopes[1])
    return bool(same_kind and np.all(apart <= _ROUNDING * steepest * width))
