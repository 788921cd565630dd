"""The law of one gear, as a polyline along which its path is followed in C, and as cubics.

A law is the torque of a gear's spring and its elements over the wind-up from a place of its path on,

    S(e) + sum_j f_j clip((s_j + e - e_0) / a_j, +-1)        (`elastic_robot.hysteresis`),

until e turns back where an element slips: from there on it is another one.  Springs that bend are
taken for chords.
"""

from __future__ import annotations

import ctypes
from dataclasses import dataclass

import numpy as np

from coupling.inverse.gear_elements import NO_ELEMENTS, GearElements
from coupling.native.desk_library import loaded_library
from coupling.native.desk_robot import address, finite_numbers, numbers
from elastic_robot.spline_curve import SplineCurve
from elastic_robot.torque_curves import TorqueCurve

# Chords of a spring that bends, between two of its knots.
_CHORDS = 64


class _Law(ctypes.Structure):
    """er_gear_law of desk/gear_path.h."""

    _fields_ = (
        ("corners", ctypes.c_int64),
        *((name, ctypes.c_void_p) for name in ("angle", "torque", "slope")),
    )


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
            start: Wind-up from which on they are followed [rad].
            elongation: Their elongations there [rad], (e,).
        """
        begin = finite_numbers("elongations", elongation, (elements.count,))
        room = len(self.angle) + 2 * elements.count
        angle, torque, slope = np.empty(room), np.empty(room), np.empty(room + 1)
        law, _read = self._in_c()
        count = loaded_library().er_gear_law_with_elements(
            ctypes.byref(law),
            ctypes.byref(elements.struct),
            ctypes.c_double(start),
            *map(address, (begin, angle, torque, slope)),
        )
        return GearLaw(angle[:count].copy(), torque[:count].copy(), slope[: count + 1].copy())

    def _in_c(self) -> tuple[_Law, list[np.ndarray]]:
        """Return the law as C has it, and arrays that stay as long as C reads it."""
        corners = len(self.angle)
        if not corners or (np.diff(self.angle) <= 0.0).any():
            raise ValueError("expected rising angles of a law")
        values = zip(
            ("angles", "torques", "slopes"), (self.angle, self.torque, self.slope), strict=True
        )
        arrays = [finite_numbers(n, v, (corners + (n == "slopes"),)) for n, v in values]
        return _Law(corners, *map(address, arrays)), arrays

    def path(
        self,
        spacing: float,
        torque: np.ndarray,
        damping: float,
        start: float,
        elements: GearElements = NO_ELEMENTS,
    ) -> tuple[np.ndarray, np.ndarray]:
        """Return the wind-up [rad] and its rate [rad/s] of a gear at samples, (n,) each.

        Args:
            spacing: Time between samples [s].
            torque: T at the samples [N m], (n,), straight in between.
            damping: d [N m s/rad], > 0.
            start: e at the first sample [rad], to which the elements came from unloaded.
            elements: Elements of its hysteresis.
        """
        pulls = numbers("torques", torque, (len(torque),))
        angle, rate = np.empty_like(pulls), np.empty_like(pulls)
        law, _read = self._in_c()
        followed = loaded_library().er_gear_path(
            ctypes.byref(law),
            ctypes.byref(elements.struct),
            ctypes.c_double(damping),
            ctypes.c_double(spacing),
            ctypes.c_int64(len(pulls)),
            address(pulls),
            ctypes.c_double(start),
            *map(address, (angle, rate)),
        )
        if not followed:
            raise MemoryError("the law of a gear does not fit into memory")
        return angle, rate


def cubic_pieces(curve: TorqueCurve) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Return the torque curve of one gear as p cubics.

    Returns:
        Rising angles, the last ones of their pieces [rad], (p - 1,); the angle from which each piece
        counts [rad], (p,); coefficients of 1, t, t^2, t^3 [N m], t from there [rad], (p, 4).

    Example:
        >>> from elastic_robot.torque_curves import BacklashCurve
        >>> cubic_pieces(BacklashCurve(np.array([1e4]), np.array([1e-3])))[2][:, 1]
        array([10000.,     0., 10000.])
    """
    if isinstance(curve, SplineCurve):
        knots = curve.knots[0][np.isfinite(curve.knots[0])]
        pieces = slice(0, len(knots) + 1)
        return knots, curve.origins[0, pieces], curve.cubics[0, pieces]
    (edges,) = curve.bend_angles
    knots = edges[np.isfinite(edges)]
    if not len(knots):
        (slope,) = curve.slope(np.zeros(1))
        return knots, np.zeros(1), np.array([[0.0, slope, 0.0, 0.0]])
    low, high = knots
    slopes = [float(curve.slope(np.array([x]))[0]) for x in (low - 1.0, 0.0, high + 1.0)]
    cubics = [[0.0, slope, 0.0, 0.0] for slope in slopes]
    # On its edges a backlash has no stiffness.
    knots = np.array([np.nextafter(low, -np.inf), high])
    return knots, np.array([low, 0.0, high]), np.array(cubics)
