"""Balancers: springs beside the gears, between a link and the one before it.

A balancer turns the link of its joint about the joint's axis by a torque tau_b(phi), phi the angle of
the joint behind its gear.  It stands in the joint's row of every load M theta'' + h - J^T w as -tau_b,
with the slope -dtau_b/dphi.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from elastic_robot.description import Robot, Table

if TYPE_CHECKING:
    from scipy.interpolate import CubicSpline


@dataclass(frozen=True)
class BalancerCurve:
    """Torque of one balancer: a natural cubic spline, straight beyond its ends.

    Attributes:
        spline: The spline, angle [rad] to torque [N m].

    Example:
        >>> curve = BalancerCurve.through(((-1.0, 10.0), (0.0, 0.0), (1.0, -10.0)))
        >>> curve.torque(np.array([0.5, 2.0])).tolist()
        [-5.0, -20.0]
    """

    spline: CubicSpline

    @classmethod
    def through(cls, table: Table) -> BalancerCurve:
        """Return the curve through points [rad, N m]."""
        from scipy.interpolate import CubicSpline

        spline = CubicSpline(*np.array(table, dtype=float).T, bc_type="natural")
        first, last = spline.x[[0, -1]]
        for end, outside in ((last, last + 1.0), (first, first - 1.0)):
            slope = spline(end, 1)
            line = [0.0, 0.0, slope, spline(end) + slope * (min(end, outside) - end)]
            spline.extend(np.array(line)[:, None], np.array([outside]))
        return cls(spline)

    def torque(self, angle: np.ndarray) -> np.ndarray:
        """Return tau_b [N m] at angles [rad], of their shape."""
        return self.spline(angle)

    def work(self, angle: float) -> float:
        """Return int_0^angle tau_b [J]."""
        return float(self.spline.integrate(0.0, angle))

    def slope(self, angle: np.ndarray) -> np.ndarray:
        """Return dtau_b/dphi [N m/rad] at angles [rad], of their shape."""
        return self.spline(angle, 1)


@dataclass(frozen=True)
class Balancers:
    """The balancers of a chain, b of them.

    Attributes:
        place: Index in theta of the angle of each, (b,).
        curves: Their curves.
    """

    place: np.ndarray
    curves: tuple[BalancerCurve, ...]

    @classmethod
    def of(cls, robot: Robot, drive: np.ndarray) -> Balancers:
        """Return those of a robot whose joints have the places `drive` in theta, (n,)."""
        has = [i for i, joint in enumerate(robot.joints) if joint.balancer is not None]
        tables = [joint.balancer for joint in robot.joints if joint.balancer is not None]
        return cls(drive[np.array(has, dtype=int)], tuple(map(BalancerCurve.through, tables)))

    def relieve(self, load: np.ndarray, theta: np.ndarray) -> None:
        """Take tau_b off loads M theta'' + h - J^T w [N m]; theta [rad], (..., angles) each."""
        for place, curve in zip(self.place.tolist(), self.curves, strict=True):
            load[..., place] -= curve.torque(theta[..., place])

    def energy(self, theta: np.ndarray) -> float:
        """Return the potential of their springs at theta [rad], (angles,): minus what they do, [J]."""
        pairs = zip(self.place.tolist(), self.curves, strict=True)
        return -sum(curve.work(float(theta[place])) for place, curve in pairs)

    def relieve_gradient(self, gradient: np.ndarray, theta: np.ndarray) -> None:
        """Take dtau_b/dphi off their derivatives by theta [N m/rad], (..., angles, angles)."""
        for place, curve in zip(self.place.tolist(), self.curves, strict=True):
            gradient[..., place, place] -= curve.slope(theta[..., place])
