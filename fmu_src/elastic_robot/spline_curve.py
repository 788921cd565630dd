"""Smooth characteristic curve of a geared joint: Akima's interpolation of angle and torque.

The variant of the paper's first implementation.  By default the points are those of a backlash with
rounded corners; a joint may bring its own table.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import cached_property
from typing import TYPE_CHECKING, ClassVar

import numpy as np

from elastic_robot.parameters import Parameters

if TYPE_CHECKING:
    from scipy.interpolate import PPoly

# A jump of the curvature counts from this part of the largest curvature on.
_SMALLEST_JUMP = 1e-9
# Newton steps of the inversion inside one cubic piece; it starts on the chord.
_INVERSION_STEPS = 12


def rounded_backlash(stiffness: float, backlash: float) -> tuple[np.ndarray, np.ndarray]:
    """Return angles [rad] and torques [N m] of a backlash whose corners are rounded.

    Zero up to B/2, a parabola to 3B/2, then the line k (|x| - B).  Knots B/2 apart make Akima's
    curve equal to that shape, so it rises everywhere; knots on the sharp corners would let it
    undershoot (slopes k/2 at the corner with a flat piece beside it).

    Args:
        stiffness: k [N m/rad].
        backlash: B, half width of the backlash [rad], > 0.
    """
    half = 0.5 * backlash
    angle = half * np.array([0.0, 1.0, 2.0, 3.0, 4.0, 5.0])
    torque = stiffness * half * np.array([0.0, 0.0, 0.25, 1.0, 2.0, 3.0])
    return np.append(-angle[:0:-1], angle), np.append(-torque[:0:-1], torque)


def akima(angle: np.ndarray, torque: np.ndarray) -> PPoly:
    """Return Akima's curve through points of rising angle [rad] and torque [N m], (p,) each.

    Raises:
        ValueError: If the curve falls between two of them; with the angles.
    """
    from scipy.interpolate import Akima1DInterpolator

    curve = Akima1DInterpolator(angle, torque)
    slope = curve.derivative()
    # A quadratic is lowest at its ends or at its vertex.
    width = np.diff(angle)
    c2, c1, c0 = slope.c
    with np.errstate(divide="ignore", invalid="ignore"):
        vertex = np.clip(np.nan_to_num(-c1 / (2.0 * c2)), 0.0, width)
    lowest = np.min([c0, c0 + (c1 + c2 * width) * width, c0 + (c1 + c2 * vertex) * vertex], axis=0)
    scale = np.ptp(torque) / np.ptp(angle)
    falls = np.flatnonzero(lowest < -1e-12 * scale)
    if len(falls):
        k = int(falls[0])
        raise ValueError(
            f"curve through the points: expected a rise, got a slope of {lowest[k]:.4g} N m/rad between"
            f" {angle[k]:.6g} and {angle[k + 1]:.6g} rad: give more points there"
        )
    return curve


@dataclass(frozen=True)
class SplineCurve:
    """Torque along piecewise cubics, straight beyond the last points.

    Attributes:
        knots: Angles where pieces meet [rad], padded with infinity, (m, pieces - 1).
        origins: Angle from which each piece counts [rad], (m, pieces).
        cubics: Coefficients of 1, t, t^2, t^3 [N m], t from a piece's origin [rad], (m, pieces, 4).
        half_width: Half width of the flat middle [rad]; infinite where there is none, (m,).
        active: Mask of coordinates that are not held on their flat middle, (m,).
    """

    has_backlash: ClassVar[bool] = True
    takes_tables: ClassVar[bool] = True

    knots: np.ndarray
    origins: np.ndarray
    cubics: np.ndarray
    half_width: np.ndarray
    active: np.ndarray

    @classmethod
    def build(cls, parameters: Parameters) -> SplineCurve:
        """Return the curves of all coordinates: a table's, a rounded backlash's, or a line.

        Raises:
            ValueError: If a table's curve does not rise everywhere.
        """
        count = len(parameters.stiffness)
        curves: list[PPoly | None] = []
        half_width = np.full(count, np.inf)
        for k in range(count):
            table, backlash = parameters.tables[k], float(parameters.backlash[k])
            if table is not None:
                curves.append(akima(*np.array(table).T))
            elif backlash > 0.0:
                curves.append(akima(*rounded_backlash(float(parameters.stiffness[k]), backlash)))
                half_width[k] = 0.5 * backlash
            else:
                curves.append(None)
        most = max([len(curve.x) for curve in curves if curve is not None], default=0)
        knots = np.full((count, most), np.inf)
        origins, cubics = np.zeros((count, most + 1)), np.zeros((count, most + 1, 4))
        for k, curve in enumerate(curves):
            if curve is None:
                cubics[k, :, 1] = parameters.stiffness[k]
                continue
            x, size = curve.x, len(curve.x)
            knots[k, :size] = x
            origins[k, : size + 1] = np.concatenate([x[:1], x])
            cubics[k, 1:size] = curve.c[::-1].T
            for piece, end in ((0, x[0]), (size, x[-1])):
                cubics[k, piece, :2] = curve(end), curve(end, 1)
        return cls(knots, origins, cubics, half_width, np.ones(count, dtype=bool))

    def torque(self, x: np.ndarray) -> np.ndarray:
        """S(x) [N m], shape of x."""
        c, t = self._piece(x)
        return self.active * (c[..., 0] + t * (c[..., 1] + t * (c[..., 2] + t * c[..., 3])))

    def slope(self, x: np.ndarray) -> np.ndarray:
        """dS/dx [N m/rad]."""
        c, t = self._piece(x)
        return self.active * (c[..., 1] + t * (2.0 * c[..., 2] + 3.0 * t * c[..., 3]))

    def stiffness_gradient(self, x: np.ndarray) -> np.ndarray:
        """dS/dk = S/k [rad]; 0 for a table, which takes the place of the stiffness."""
        return np.where(self._tabulated, 0.0, self.torque(x) / self._end_slope)

    def backlash_gradient(self, x: np.ndarray) -> np.ndarray:
        """dS/dB = (S - x dS/dx) / B [N m/rad]: the curve is k B times a function of x / B.

        -k sign(x), that of a backlash that opens, for a straight line; 0 for a table.
        """
        scaled = (self.torque(x) - x * self.slope(x)) / (2.0 * self.half_width)
        opening = np.where(self._tabulated, 0.0, -self._end_slope * np.sign(x))
        return np.where(np.isfinite(self.half_width), scaled, opening)

    def flank_slope(self, x: np.ndarray) -> np.ndarray:
        """dS/dx [N m/rad]; inside a flat middle that of the upper end."""
        slope = self.slope(x)
        return np.where(slope > 0.0, slope, self._end_slope)

    def deflection(self, torque: np.ndarray) -> np.ndarray:
        """Angle at which the curve carries a torque [rad]; 0 for none."""
        rows = np.arange(len(self.half_width))
        piece = np.sum(torque[:, None] > self._knot_torques, axis=1)
        c, origin = self.cubics[rows, piece], self.origins[rows, piece]
        inner = np.append(self.knots, np.full((len(rows), 1), np.inf), axis=1)[rows, piece]
        longest = np.where((piece > 0) & np.isfinite(inner), inner - origin, np.inf)
        t = np.zeros(len(rows))
        is_inside = np.isfinite(longest)
        t[is_inside] = 0.5 * longest[is_inside]
        for _ in range(_INVERSION_STEPS):
            value = c[:, 0] + t * (c[:, 1] + t * (c[:, 2] + t * c[:, 3]))
            slope = c[:, 1] + t * (2.0 * c[:, 2] + 3.0 * t * c[:, 3])
            newton_step = t - (value - torque) / np.maximum(slope, 1e-6 * self._end_slope)
            t = np.where(is_inside, np.clip(newton_step, 0.0, longest), newton_step)
        return np.where((torque == 0.0) & np.isfinite(self.half_width), 0.0, origin + t)

    def region(self, x: np.ndarray) -> np.ndarray:
        """Return -1 below a flat middle, 0 inside, 1 above; 1 for a coordinate without."""
        side = np.sign(x).astype(int) * (np.abs(x) > self.half_width)
        return np.where(np.isfinite(self.half_width), side, 1)

    def in_region(self, region: np.ndarray) -> SplineCurve:
        """Return the curve with zero torque for coordinates held inside their flat middle."""
        return replace(self, active=region != 0)

    def _piece(self, x: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Coefficients (..., m, 4) and local angle (..., m) of the pieces that hold at x."""
        rows = np.arange(len(self.half_width))
        if len(rows) == 1:  # along a path, where one search for all angles is far shorter
            piece = np.searchsorted(self.knots[0], x)
        else:
            piece = np.sum(x[..., None] > self.knots, axis=-1)
        return self.cubics[rows, piece], x - self.origins[rows, piece]

    @cached_property
    def bends(self) -> np.ndarray:
        """Mask of coordinates with points, (m,)."""
        return np.isfinite(self.knots).any(axis=1)

    @cached_property
    def bend_angles(self) -> np.ndarray:
        """The knots at which the curvature jumps."""
        rows, inside = np.arange(len(self.knots)), np.isfinite(self.knots)
        knots = np.where(inside, self.knots, self.origins[:, :-1])
        inner, right = self.cubics[:, :-1], self.cubics[:, 1:]
        before = 2.0 * inner[..., 2] + 6.0 * inner[..., 3] * (knots - self.origins[:, :-1])
        behind = 2.0 * right[..., 2]
        if knots.shape[1] == 0:
            return knots
        last = np.maximum(inside.sum(axis=1) - 1, 0)
        rise, extent = right[rows, last, 0] - right[:, 0, 0], knots[rows, last] - knots[:, 0]
        with np.errstate(divide="ignore", invalid="ignore"):
            mean = np.where(extent > 0.0, np.abs(rise) / extent**2, 0.0)
        curvatures = np.where(inside, np.maximum(np.abs(before), np.abs(behind)), 0.0)
        largest = np.maximum(curvatures.max(axis=1), mean)
        jumps = inside & (np.abs(behind - before) > _SMALLEST_JUMP * largest[:, None])
        return np.sort(np.where(jumps, self.knots, np.inf), axis=1)

    @cached_property
    def _end_slope(self) -> np.ndarray:
        """Slope beyond the last knot of each coordinate."""
        last = np.sum(np.isfinite(self.knots), axis=1)
        return self.cubics[np.arange(len(last)), last, 1]

    @cached_property
    def _tabulated(self) -> np.ndarray:
        """True for a coordinate with its own table: it has knots, but no flat middle."""
        return self.bends & np.isinf(self.half_width)

    @cached_property
    def _knot_torques(self) -> np.ndarray:
        """Torque at each knot, infinite where there is none."""
        return np.where(np.isfinite(self.knots), self.cubics[:, 1:, 0], np.inf)
