"""Forces of a helical end mill: the linear-edge model, resolved in time and as a mean.

Axes of the cut: f along the feed, n to its left, z up along the spindle, away from the work.  The
cutter turns clockwise seen from above; a point of an edge is at R (sin(phi) f + cos(phi) n).  Forces
act on the tool [Altintas2012, sections 2.5 and 2.6].
"""

from __future__ import annotations

import ctypes
from dataclasses import dataclass
from functools import cached_property

import numpy as np

from coupling.native.desk_library import loaded_library
from coupling.native.desk_robot import address, numbers

# Height above the surface up to which an edge rubs, and feed below which it ploughs less: about its
# radius [m].
_RUBS = 5e-6
# Passes whose surfaces a tooth may meet: of so many turns, or so many at least.
_TURNS, _FEWEST = 2, 8
# ER_MOST_PASSES of desk/cut.h.
_MOST_PASSES = 64


@dataclass(frozen=True)
class CuttingCoefficients:
    """Force per length of edge: dF = (K_c h + K_e) dz, h the chip thickness.

    Kienzle's law, dF = k_c1.1 h^(1 - m_c) dz, is that one in its tangent at a mean chip thickness h:
    K_c = (1 - m_c) k_c1.1 h^-m_c and K_e = m_c k_c1.1 h^(1 - m_c).

    Attributes:
        K_tc, K_rc, K_ac: Coefficients of the cut, tangential, radial, axial [Pa].
        K_te, K_re, K_ae: Coefficients of the edge, whatever the chip [N/m].
    """

    K_tc: float
    K_rc: float
    K_ac: float
    K_te: float
    K_re: float
    K_ae: float


@dataclass(frozen=True)
class Cutter:
    """A cylindrical end mill for right-hand cut, with a right-hand helix or straight edges.

    Attributes:
        radius: Radius of the cutter [m].
        teeth: Number of teeth.
        helix: Angle of the edges from the axis [rad], >= 0.
        speed: Speed of the spindle [rad/s].
        pitch: Angles from each tooth to the next, which comes by before it [rad], (teeth,), a whole turn
            in all; None: even.
        runout: Offset of the cutter's axis from the spindle's [m], >= 0.
        runout_angle: Angle from the first tooth to that offset, towards the next tooth [rad].
    """

    radius: float
    teeth: int
    helix: float
    speed: float
    pitch: tuple[float, ...] | None = None
    runout: float = 0.0
    runout_angle: float = 0.0

    @property
    def tooth_period(self) -> float:
        """Time between two teeth [s], the mean where the pitch varies."""
        return 2.0 * np.pi / (self.teeth * self.speed)

    @property
    def turn_period(self) -> float:
        """Time of a turn [s]."""
        return 2.0 * np.pi / self.speed

    @property
    def period(self) -> float:
        """Time after which the teeth repeat: a tooth's, or a turn's where they differ [s]."""
        alike = self.pitch is None and self.runout == 0.0
        return self.tooth_period if alike else self.turn_period

    @property
    def tips(self) -> np.ndarray:
        """Angles of the tips at time 0 [rad], (teeth,)."""
        pitch = self.pitch or (2.0 * np.pi / self.teeth,) * self.teeth
        return np.cumsum((0.0, *pitch[:-1]))

    @property
    def memory(self) -> float:
        """Time since the earliest pass whose surface a tooth may meet [s]."""
        return float(self.passes_before[0].max())

    @cached_property
    def passes_before(self) -> tuple[np.ndarray, np.ndarray]:
        """Times since the passes before each tooth, and how far it reaches beyond their teeth.

        Returns:
            Times [s], (teeth, passes), and reach at the tip and a quarter of a turn further up the edge
            [m], (teeth, passes, 2).
        """
        count = min(max(_TURNS * self.teeth, _FEWEST), _MOST_PASSES)
        tooth, back = np.arange(self.teeth)[:, None], np.arange(1, count + 1)
        before, turns = (tooth + back) % self.teeth, (tooth + back) // self.teeth
        tips = self.tips
        delay = (tips[before] + 2.0 * np.pi * turns - tips[tooth]) / self.speed
        angle = self.runout_angle - tips
        reach = self.runout * np.column_stack([np.cos(angle), -np.sin(angle)])
        return delay, reach[:, None] - reach[before]

    @property
    def lag(self) -> float:
        """Lag of an edge with the height above the tip [rad/m]."""
        return float(np.tan(self.helix)) / self.radius


@dataclass(frozen=True)
class Engagement:
    """Engagement of the cutter at n instants.

    Attributes:
        chip: Way of the tool within the last tooth period along f and n [m], (n, 2): the chip
            thickness is h = max(0, chip_f sin(phi) + chip_n cos(phi)).
        start, end: Engaged angles phi, within 0 and pi [rad], (n,).
        depth: Axial [m], >= 0, (n,).
        edge_share: Part of the edge force that acts [1], (n,) or one for all.
    """

    chip: np.ndarray
    start: np.ndarray
    end: np.ndarray
    depth: np.ndarray
    edge_share: np.ndarray | float = 1.0


def edge_share(feed: np.ndarray) -> np.ndarray:
    """Return the part of the edge force that acts at ways of the tool from tooth to tooth [m], (n,).

    An edge ploughs what the feed brings under it: a tool that stands has none left.
    """
    return np.minimum(feed / _RUBS, 1.0)


@dataclass(frozen=True)
class Way:
    """Way of the tool's tip in the part's plane, straight from point to point.

    Attributes:
        time: Rising times [s], (n,).
        points: Positions x, y [m], (n, 2).
    """

    time: np.ndarray
    points: np.ndarray


class _Mill(ctypes.Structure):
    """er_mill of desk/cut.h."""

    _fields_ = (
        *((name, ctypes.c_int64) for name in ("teeth", "passes")),
        *((name, ctypes.c_double) for name in ("radius", "lag", "speed", "rubs")),
        *((name, ctypes.c_void_p) for name in ("tip", "delay", "further", "coefficients")),
    )


class _Engagement(ctypes.Structure):
    """er_engagement of desk/cut.h."""

    _fields_ = (
        *((name, ctypes.c_int64) for name in ("count", "arcs")),
        *((name, ctypes.c_void_p) for name in ("time", "feed", "start", "end", "depth", "share")),
    )


def tooth_wrench(
    cutter: Cutter,
    coefficients: CuttingCoefficients,
    cut: Engagement,
    way: Way,
    feed: np.ndarray,
    time: np.ndarray,
) -> np.ndarray:
    """Return the wrench of all teeth at given instants, the first tip being at phi = 0 at time 0.

    An edge cuts from where it is down to what the passes before it have left.  Where that is nothing it
    carries no force; where it lifts off its edge force fades out.

    Args:
        cutter: The tool.
        coefficients: Cutting coefficients of the material.
        cut: Engagement at these instants.
        way: Way of the tool, from `cutter.memory` before them on.
        feed: Unit vectors along the feed at these instants, in the plane of the way, (n, 2).
        time: Rising times [s], (n,).

    Returns:
        Forces [N] and moments about the tip's centre [N m], axes f, n, z, (n, 6).
    """
    K, count, points = coefficients, len(time), len(way.time)
    delay, further = cutter.passes_before
    force = np.array([K.K_tc, K.K_rc, K.K_ac, K.K_te, K.K_re, K.K_ae])
    of_mill = [np.ascontiguousarray(values) for values in (cutter.tips, delay, further, force)]
    arc = (numbers("arcs", values, (count,)) for values in (cut.start, cut.end, cut.depth))
    share = np.full(count, cut.edge_share)
    of_cut = [numbers("time", time, (count,)), numbers("feed", feed, (count, 2)), *arc, share]
    moved = numbers("way", way.time, (points,)), numbers("way", way.points, (points, 2))
    mill = _Mill(
        *(*delay.shape, cutter.radius, cutter.lag, cutter.speed, _RUBS), *map(address, of_mill)
    )
    wrench = np.empty((count, 6))
    loaded_library().er_mill_wrench(
        ctypes.byref(mill),
        ctypes.byref(_Engagement(count, 1, *map(address, of_cut))),
        ctypes.c_int64(points),
        *map(address, (*moved, wrench)),
    )
    return wrench


def mean_wrench(cutter: Cutter, coefficients: CuttingCoefficients, cut: Engagement) -> np.ndarray:
    """Return the wrench averaged over a revolution, axes f, n, z, (n, 6).

    Closed form [Altintas2012, eq. (2.37)], with the chip's part across the feed and moments added.

    Example:
        >>> mill = Cutter(radius=8e-3, teeth=2, helix=0.5, speed=1000.0)
        >>> slot = Engagement(np.array([[1e-4, 0.0]]), np.array([0.0]), np.array([np.pi]),
        ...     np.array([3e-3]))
        >>> force = mean_wrench(mill, CuttingCoefficients(8e8, 2e8, 0, 2e4, 1e4, 0), slot)[0, :3]
        >>> force.round(1)  # -N a (K_rc c/4 + K_re/pi), N a (K_tc c/4 + K_te/pi)
        array([-49.1, 158.2,  -0. ])
    """
    K, R = coefficients, cutter.radius
    a, b = cut.chip.T
    K_te, K_re, K_ae = (cut.edge_share * edge for edge in (K.K_te, K.K_re, K.K_ae))

    def over_arc(integral: np.ndarray) -> np.ndarray:
        return integral[1] - integral[0]

    # Integrals over the engaged arc of 1, sin, cos and their products.
    phi = np.stack([cut.start, cut.end])
    angle, sin, cos = over_arc(phi), over_arc(-np.cos(phi)), over_arc(np.sin(phi))
    sin_sin = over_arc(0.5 * phi - 0.25 * np.sin(2.0 * phi))
    cos_cos = over_arc(0.5 * phi + 0.25 * np.sin(2.0 * phi))
    sin_cos = over_arc(-0.25 * np.cos(2.0 * phi))
    # Chip thickness times 1, sin and cos, over the arc.
    h, h_sin, h_cos = a * sin + b * cos, a * sin_sin + b * sin_cos, a * sin_cos + b * cos_cos
    tangential, tangential_sin, tangential_cos = (
        K.K_tc * h + K_te * angle,
        K.K_tc * h_sin + K_te * sin,
        K.K_tc * h_cos + K_te * cos,
    )
    radial_sin, radial_cos = K.K_rc * h_sin + K_re * sin, K.K_rc * h_cos + K_re * cos
    axial, axial_sin, axial_cos = (
        K.K_ac * h + K_ae * angle,
        K.K_ac * h_sin + K_ae * sin,
        K.K_ac * h_cos + K_ae * cos,
    )
    along, across = -tangential_cos - radial_sin, tangential_sin - radial_cos
    middle = 0.5 * cut.depth
    wrench = np.column_stack(
        [
            along,
            across,
            -axial,
            -middle * across - R * axial_cos,
            middle * along + R * axial_sin,
            R * tangential,
        ]
    )
    return (cutter.teeth * cut.depth / (2.0 * np.pi))[:, None] * wrench


def end_wrench(
    cutter: Cutter, coefficients: CuttingCoefficients, length: float, descent: np.ndarray
) -> np.ndarray:
    """Return the mean wrench of the edges on the end of a cutter that goes down, axes f, n, z, (n, 6).

    They lie in a plane across its axis, one for each tooth, and carry the force of the edges on its side
    at an axial immersion angle of zero [Engin2001]: what is radial there presses the tool upwards.

    Args:
        cutter: The tool.
        coefficients: Cutting coefficients of the material.
        length: Length of these edges, from the rim inwards [m].
        descent: Way of the tool downwards from tooth to tooth, their chip [m], >= 0, (n,).

    Example:
        >>> mill = Cutter(radius=8e-3, teeth=2, helix=0.5, speed=1000.0)
        >>> material = CuttingCoefficients(8e8, 2e8, 0, 2e4, 1e4, 0)
        >>> end_wrench(mill, material, 8e-3, np.array([1e-5]))[0, [2, 5]].round(3).tolist()
        [192.0, 1.792]
    """
    K, share = coefficients, edge_share(descent)
    wrench = np.zeros((len(descent), 6))
    wrench[:, 2] = cutter.teeth * length * (K.K_rc * descent + share * K.K_re)
    lever = cutter.radius - 0.5 * length
    wrench[:, 5] = cutter.teeth * length * lever * (K.K_tc * descent + share * K.K_te)
    return wrench


def wrench_of_edge(
    radius: float,
    edge: tuple[np.ndarray | float, np.ndarray | float, np.ndarray | float],
    phi: np.ndarray,
    height: np.ndarray,
) -> np.ndarray:
    """Return the wrench on the tool of forces at points of its edges, axes f, n, z.

    Args:
        radius: Radius of the cutter [m].
        edge: Tangential, radial and axial force in any unit, numbers or of the shape of `phi`.
        phi: Angles of the points [rad], (...).
        height: Their heights above the tip [m], shape of `phi`.

    Returns:
        Forces in that unit, and moments about the tip's centre in it times [m], (..., 6).
    """
    tangential, radial, axial = edge
    sin, cos = np.sin(phi), np.cos(phi)
    along, across = -tangential * cos - radial * sin, tangential * sin - radial * cos
    return np.stack(
        [
            along,
            across,
            -axial * np.ones_like(phi),
            -height * across - radius * cos * axial,
            height * along + radius * sin * axial,
            radius * tangential * np.ones_like(phi),
        ],
        axis=-1,
    )
