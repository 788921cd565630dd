"""Forces of a helical end mill: the linear-edge model, resolved in time and as a mean.

Axes of the cut: f along the feed, n to its left, z up along the spindle, away from the work.  The
cutter turns clockwise seen from above; a point of an edge is at R (sin(phi) f + cos(phi) n).  Forces
act on the tool [Altintas2012, sections 2.5 and 2.6].
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

# Gauss points along the engaged part of an edge: exact to rounding for lags up to half a turn.
_NODES, _WEIGHTS = np.polynomial.legendre.leggauss(12)


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
        teeth: Number, evenly spaced.
        helix: Angle of the edges from the axis [rad], >= 0.
        speed: Speed of the spindle [rad/s].
    """

    radius: float
    teeth: int
    helix: float
    speed: float

    @property
    def tooth_period(self) -> float:
        """Time between two teeth [s]."""
        return 2.0 * np.pi / (self.teeth * self.speed)

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
    """

    chip: np.ndarray
    start: np.ndarray
    end: np.ndarray
    depth: np.ndarray


def tooth_wrench(
    cutter: Cutter, coefficients: CuttingCoefficients, cut: Engagement, time: np.ndarray
) -> np.ndarray:
    """Return the wrench of all teeth at given instants, the first tip being at phi = 0 at time 0.

    Args:
        cutter: The tool.
        coefficients: Cutting coefficients of the material.
        cut: Cut at these instants.
        time: Times [s], (n,).

    Returns:
        Forces [N] and moments about the tip's centre [N m], axes f, n, z, (n, 6).
    """
    wrench = np.zeros((len(time), 6))
    turns = int(np.ceil(cutter.lag * float(cut.depth.max(initial=0.0)) / (2.0 * np.pi)))
    for tooth in range(cutter.teeth):
        tip = (cutter.speed * time + 2.0 * np.pi * tooth / cutter.teeth) % (2.0 * np.pi)
        for turn in range(turns + 1):  # further up an edge may be a whole turn behind
            low, high = _engaged(tip + 2.0 * np.pi * turn, cutter.lag, cut)
            for node, weight in zip(_NODES, _WEIGHTS, strict=True):
                height = low + 0.5 * (1.0 + node) * (high - low)
                phi = tip - cutter.lag * height
                per_length = _edge_wrench(cutter, coefficients, cut.chip, phi, height)
                wrench += (0.5 * weight * (high - low))[:, None] * per_length
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
        K.K_tc * h + K.K_te * angle,
        K.K_tc * h_sin + K.K_te * sin,
        K.K_tc * h_cos + K.K_te * cos,
    )
    radial_sin, radial_cos = K.K_rc * h_sin + K.K_re * sin, K.K_rc * h_cos + K.K_re * cos
    axial, axial_sin, axial_cos = (
        K.K_ac * h + K.K_ae * angle,
        K.K_ac * h_sin + K.K_ae * sin,
        K.K_ac * h_cos + K.K_ae * cos,
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


def _engaged(tip: np.ndarray, lag: float, cut: Engagement) -> tuple[np.ndarray, np.ndarray]:
    """Return the heights between which an edge, at `tip` at its lower end, is in the cut."""
    if lag == 0.0:
        inside = (cut.start <= tip) & (tip <= cut.end)
        return np.zeros_like(tip), np.where(inside, cut.depth, 0.0)
    low = np.clip((tip - cut.end) / lag, 0.0, cut.depth)
    return low, np.clip((tip - cut.start) / lag, 0.0, cut.depth)


def _edge_wrench(
    cutter: Cutter,
    coefficients: CuttingCoefficients,
    chip: np.ndarray,
    phi: np.ndarray,
    height: np.ndarray,
) -> np.ndarray:
    """Return force and moment per length of axis [N/m, N] at points of an edge, (n, 6)."""
    K = coefficients
    h = np.maximum(chip[:, 0] * np.sin(phi) + chip[:, 1] * np.cos(phi), 0.0)
    # A right-hand helix is pulled into the work.
    edge = (K.K_tc * h + K.K_te, K.K_rc * h + K.K_re, K.K_ac * h + K.K_ae)
    return wrench_of_edge(cutter.radius, edge, phi, height)


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
