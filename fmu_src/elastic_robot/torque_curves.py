"""Restoring torque of the elastic coordinates over their angle: the curves S of the robot model.

A curve serves all coordinates at once: its parameters are arrays with one entry per coordinate,
tilts having no backlash.  The family's verbs are `torque`, `slope`, `deflection` and `region`;
`in_region` gives a stepper one smooth law to integrate, so that it can stop where the law changes.
`stiffness_gradient` and `backlash_gradient` say how the torque at a given angle follows its parameters.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from functools import cached_property
from typing import ClassVar, Protocol

import numpy as np

from elastic_robot.parameters import Parameters
from elastic_robot.spline_curve import SplineCurve

# Nodes of Gauss-Legendre, which integrate the cubics of a torque curve exactly.
_NODES = 0.5 + np.array([-0.5, 0.5]) / np.sqrt(3.0)


class Branch(Protocol):
    """One smooth law; arrays are (m,) or (k, m), one column per elastic coordinate."""

    def torque(self, x: np.ndarray) -> np.ndarray:
        """Restoring torque S(x) [N m]."""

    def slope(self, x: np.ndarray) -> np.ndarray:
        """dS/dx [N m/rad]."""

    def stiffness_gradient(self, x: np.ndarray) -> np.ndarray:
        """dS/dk at fixed x [rad]."""

    def backlash_gradient(self, x: np.ndarray) -> np.ndarray:
        """dS/dB at fixed x [N m/rad]; without backlash that of a backlash that opens."""


class TorqueCurve(Branch, Protocol):
    """A law with its branches, odd and rising in x; arrays are (m,) or (k, m)."""

    @property
    def half_width(self) -> np.ndarray:
        """Angle +-half_width at which the law changes [rad]; infinite for a smooth curve."""

    @property
    def bends(self) -> np.ndarray:
        """Mask of coordinates whose slope changes along a branch, (m,)."""

    @property
    def bend_angles(self) -> np.ndarray:
        """Rising angles of jumps of slope or curvature [rad], padded with infinity, (m, most)."""

    def flank_slope(self, x: np.ndarray) -> np.ndarray:
        """dS/dx [N m/rad], of the nearest engaged flank where the gear is inside its backlash."""

    def deflection(self, torque: np.ndarray) -> np.ndarray:
        """Angle x [rad] at which the curve carries a torque; 0 where that is not unique."""

    def region(self, x: np.ndarray) -> np.ndarray:
        """Number of the branch x lies on: -1, 0 (inside the backlash) or 1; 1 everywhere if smooth."""

    def in_region(self, region: np.ndarray) -> Branch:
        """Return the branch of a number as of `region`, continued beyond its ends."""


class CurveClass(Protocol):
    """A class of curves, as the dictionary of curves holds it.

    Attributes:
        has_backlash: Whether its torque depends on the backlash.
        takes_tables: Whether a gear's own table replaces its stiffness and backlash.
    """

    has_backlash: bool
    takes_tables: bool

    def build(self, parameters: Parameters) -> TorqueCurve:
        """Return the curve of given parameters."""


@dataclass(frozen=True)
class LinearCurve:
    """Torque k x of a spring without backlash.

    Attributes:
        stiffness: Stiffness k [N m/rad], > 0, (m,).

    Example:
        >>> LinearCurve(np.array([1e4])).torque(np.array([2e-3]))
        array([20.])
    """

    has_backlash: ClassVar[bool] = False
    takes_tables: ClassVar[bool] = False

    stiffness: np.ndarray

    @classmethod
    def build(cls, parameters: Parameters) -> LinearCurve:
        """Return the curve of given parameters; the backlash is left out."""
        return cls(parameters.stiffness)

    @cached_property
    def half_width(self) -> np.ndarray:
        """Infinite: the law never changes."""
        return np.full(np.shape(self.stiffness), np.inf)

    @cached_property
    def bends(self) -> np.ndarray:
        """Nowhere."""
        return np.zeros(np.shape(self.stiffness), dtype=bool)

    @cached_property
    def bend_angles(self) -> np.ndarray:
        """None."""
        return np.empty((*np.shape(self.stiffness), 0))

    def torque(self, x: np.ndarray) -> np.ndarray:
        """S(x) = k x [N m]."""
        return self.stiffness * x

    def slope(self, x: np.ndarray) -> np.ndarray:
        """Return k [N m/rad]."""
        return np.broadcast_to(self.stiffness, np.shape(x))

    def stiffness_gradient(self, x: np.ndarray) -> np.ndarray:
        """dS/dk = x [rad]."""
        return x

    def backlash_gradient(self, x: np.ndarray) -> np.ndarray:
        """Return 0 [N m/rad]: the backlash is left out."""
        return np.zeros(np.shape(x))

    def flank_slope(self, x: np.ndarray) -> np.ndarray:
        """Return k [N m/rad]."""
        return self.slope(x)

    def deflection(self, torque: np.ndarray) -> np.ndarray:
        """Return x = torque / k [rad]."""
        return torque / self.stiffness

    def region(self, x: np.ndarray) -> np.ndarray:
        """Return 1: there is one branch."""
        return np.ones(np.shape(x), dtype=int)

    def in_region(self, region: np.ndarray) -> LinearCurve:
        """Return the curve itself."""
        del region
        return self


@dataclass(frozen=True)
class BacklashCurve:
    """Torque of a gear with backlash: zero inside the backlash, linear outside it.

    S(x) = k sign(x) max(|x| - B, 0), the piecewise linear variant of Abele et al. 2008 (docs/
    references.md).

    Attributes:
        stiffness: Slope k outside the backlash [N m/rad], > 0, (m,).
        backlash: Half width B of the backlash, centred on zero [rad], >= 0, (m,).

    Example:
        >>> BacklashCurve(np.array([1e4]), np.array([1e-3])).torque(np.array([[5e-4], [3e-3]]))
        array([[ 0.],
               [20.]])
    """

    has_backlash: ClassVar[bool] = True
    takes_tables: ClassVar[bool] = False

    stiffness: np.ndarray
    backlash: np.ndarray

    @classmethod
    def build(cls, parameters: Parameters) -> BacklashCurve:
        """Return the curve of given parameters."""
        return cls(parameters.stiffness, parameters.backlash)

    @cached_property
    def half_width(self) -> np.ndarray:
        """B, or infinite for a coordinate without backlash: its law never changes."""
        return np.where(self.backlash > 0.0, self.backlash, np.inf)

    @cached_property
    def bends(self) -> np.ndarray:
        """Nowhere: every branch is straight."""
        return np.zeros(np.shape(self.stiffness), dtype=bool)

    @cached_property
    def bend_angles(self) -> np.ndarray:
        """The edges of the backlash."""
        edges = np.stack([-self.half_width, self.half_width], axis=-1)
        return np.where(np.isfinite(edges), edges, np.inf)

    def torque(self, x: np.ndarray) -> np.ndarray:
        """S(x) [N m], shape of x."""
        excess = np.maximum(np.abs(x) - self.backlash, 0.0)
        return self.stiffness * np.copysign(excess, x)

    def slope(self, x: np.ndarray) -> np.ndarray:
        """Return k outside the backlash, 0 inside [N m/rad]."""
        return self.stiffness * ((np.abs(x) > self.backlash) | (self.backlash == 0.0))

    def stiffness_gradient(self, x: np.ndarray) -> np.ndarray:
        """dS/dk = sign(x) max(|x| - B, 0) [rad]."""
        return self.in_region(self.region(x)).stiffness_gradient(x)

    def backlash_gradient(self, x: np.ndarray) -> np.ndarray:
        """dS/dB = -k sign(x) outside the backlash, 0 inside [N m/rad]."""
        return self.in_region(self.region(x)).backlash_gradient(x)

    def flank_slope(self, x: np.ndarray) -> np.ndarray:
        """Return k [N m/rad], inside the backlash too."""
        return np.broadcast_to(self.stiffness, np.shape(x))

    def deflection(self, torque: np.ndarray) -> np.ndarray:
        """Return x = torque / k + B sign(torque) [rad]; 0 for no torque, the middle of the backlash."""
        return torque / self.stiffness + self.backlash * np.sign(torque)

    def region(self, x: np.ndarray) -> np.ndarray:
        """Return -1 below the backlash, 0 inside, 1 above; 1 for a coordinate without backlash."""
        side = np.sign(x).astype(int) * (np.abs(x) > self.backlash)
        return np.where(self.backlash > 0.0, side, 1)

    def in_region(self, region: np.ndarray) -> BacklashBranch:
        """Return the straight line of the branch: k (x - B region), or zero inside the backlash."""
        return BacklashBranch(self.stiffness, self.backlash, region)


@dataclass(frozen=True)
class BacklashBranch:
    """One branch of `BacklashCurve`, a straight line: k (x - B region), or zero inside the backlash.

    Attributes:
        stiffness: Stiffness k [N m/rad], > 0, (m,).
        backlash: Half width B of the backlash [rad], >= 0, (m,).
        region: Number of each coordinate's branch, `BacklashCurve.region`, (m,) or (k, m).

    Example:
        >>> flank = BacklashBranch(np.array([1e4]), np.array([1e-3]), np.array([-1]))
        >>> flank.torque(np.array([-3e-3])), flank.backlash_gradient(np.array([-3e-3]))
        (array([-20.]), array([10000.]))
    """

    stiffness: np.ndarray
    backlash: np.ndarray
    region: np.ndarray

    def torque(self, x: np.ndarray) -> np.ndarray:
        """S(x) [N m], shape of x."""
        return self._slope * x - self._offset

    def slope(self, x: np.ndarray) -> np.ndarray:
        """Return k, or 0 inside the backlash [N m/rad]."""
        return np.broadcast_to(self._slope, np.shape(x))

    def stiffness_gradient(self, x: np.ndarray) -> np.ndarray:
        """dS/dk = x - B region, or 0 inside the backlash [rad]."""
        return self._engaged * (x - self.backlash * self.region)

    def backlash_gradient(self, x: np.ndarray) -> np.ndarray:
        """dS/dB = -k region [N m/rad]; -k sign(x), that of a backlash that opens, where B = 0."""
        return -self.stiffness * np.where(self.backlash > 0.0, self.region, np.sign(x))

    @cached_property
    def _engaged(self) -> np.ndarray:
        return self.region != 0

    @cached_property
    def _slope(self) -> np.ndarray:
        return self.stiffness * self._engaged

    @cached_property
    def _offset(self) -> np.ndarray:
        return self.stiffness * self.backlash * self.region


TORQUE_CURVES: dict[str, CurveClass] = {
    "linear": LinearCurve,
    "backlash": BacklashCurve,
    "spline": SplineCurve,
}


def curve_energy(
    torque: Callable[[np.ndarray], np.ndarray], bends: np.ndarray, x: np.ndarray
) -> float:
    """Return the energy that torque curves store up to x, sum_k int_0^x_k S_k [J].

    Args:
        torque: S of all coordinates [N m], (k, m) at angles [rad], (k, m); cubic between its bends.
        bends: Angles of the bends, padded with infinity [rad], (m, b).
        x: Angles [rad], (m,).
    """
    ends = x[:, None]
    inner = np.clip(bends, np.minimum(ends, 0.0), np.maximum(ends, 0.0))
    places = np.sort(np.hstack([0.0 * ends, np.abs(inner), np.abs(ends)])) * np.sign(ends)
    start, length = places[:, :-1], np.diff(places)
    nodes = start[..., None] + length[..., None] * _NODES
    values = torque(nodes.reshape(len(x), -1).T).T.reshape(nodes.shape)
    return float((length * values.mean(axis=2)).sum())
