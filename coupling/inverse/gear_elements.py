"""Hysteresis of one gear: its elements along a path, and its torque between two reversals.

From a wind-up e_0 on, where the elements have the elongations s_j, the gear's torque is a curve of e,

    S(e) + sum_j f_j clip((s_j + e - e_0) / a_j, +-1)        (`elastic_robot.hysteresis`),

until e turns back where an element slips: from there on it is another one.  That from unloaded,
e_0 = s_j = 0, is the virgin curve.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import cached_property
from itertools import pairwise

import numpy as np

from coupling.inverse.gear_pieces import Piece
from elastic_robot.hysteresis import Elements
from elastic_robot.parameters import Parameters

# Changes of the wind-up that turn nothing [rad]: far above rounding, worth micronewton metres.
_NO_TURN = 1e-12
# Narrowest piece [rad]: far above what an angle may lie behind its end (`gear_path`).
_NARROW = 1e-12


@dataclass(frozen=True)
class GearElements:
    """Elements of one gear, e of them.

    Attributes:
        slip_torque: Torque f at which each slips [N m], (e,).
        slip_angle: Elongation a at which it slips [rad], (e,).

    Example:
        >>> element = GearElements(np.array([40.0]), np.array([2e-5]))
        >>> element.along(np.array([1e-5, 5e-5, 2e-5]), np.zeros(1)).ravel()
        array([ 0.e+00,  2.e-05, -1.e-05])
    """

    slip_torque: np.ndarray
    slip_angle: np.ndarray

    @classmethod
    def of(cls, elements: Elements, parameters: Parameters, coordinate: int) -> GearElements:
        """Return the elements of an elastic coordinate, among those of all gears."""
        own = elements.coordinate == coordinate
        slip_torque = parameters.hysteresis[coordinate] * elements.share[own]
        return cls(slip_torque, elements.slip_angle[own])

    @property
    def count(self) -> int:
        """Number of elements."""
        return len(self.slip_angle)

    @property
    def stiffness(self) -> np.ndarray:
        """Stiffness of each while it sticks [N m/rad], (e,)."""
        return self.slip_torque / self.slip_angle

    def along(self, wind_up: np.ndarray, start: np.ndarray) -> np.ndarray:
        """Return the elongations along a path [rad], (n, e).

        Args:
            wind_up: Wind-up [rad], (n,), between which it moves one way.
            start: Elongations at the first of them [rad], (e,).
        """
        grid = np.round(wind_up / _NO_TURN)
        moves = np.flatnonzero(np.diff(grid))
        way = np.sign(np.diff(grid)[moves])
        turns = np.append(0, moves[1:][way[1:] != way[:-1]])
        at_turns = np.empty((len(turns), self.count))
        s = at_turns[0] = start
        a = self.slip_angle
        for k, move in enumerate(np.diff(wind_up[turns]).tolist()):
            s = at_turns[k + 1] = np.minimum(np.maximum(s + move, -a), a)
        stay = np.diff(np.append(turns, len(wind_up)))
        moved = wind_up - np.repeat(wind_up[turns], stay)
        return np.clip(np.repeat(at_turns, stay, axis=0) + moved[:, None], -a, a)

    def torque(self, elongation: np.ndarray) -> np.ndarray:
        """Return the torque of all of them [N m], (...), at elongations (..., e)."""
        return elongation @ self.stiffness

    def slope(self, elongation: np.ndarray) -> np.ndarray:
        """Return the stiffness of those that stick [N m/rad], (...), at elongations (..., e)."""
        return (np.abs(elongation) < self.slip_angle) @ self.stiffness


NO_ELEMENTS = GearElements(np.zeros(0), np.zeros(0))


@dataclass(frozen=True)
class GearLaw:
    """Torque of one gear from a place of its path on.

    Attributes:
        spring: Pieces of S by rising angle.
        elements: Elements of its hysteresis.
        angle: Wind-up e_0 at that place [rad].
        elongation: Elongations s of the elements there [rad], (e,); none: unloaded.
    """

    spring: tuple[Piece, ...]
    elements: GearElements = NO_ELEMENTS
    angle: float = 0.0
    elongation: np.ndarray | None = None

    @cached_property
    def pieces(self) -> tuple[Piece, ...]:
        """Its pieces by rising angle, as long as the gear does not turn back where an element slips."""
        if not self.elements.count:
            return self.spring
        a, k, rest = self.elements.slip_angle, self.elements.stiffness, self.angle - self._start
        upper, lower = np.split(self._edges(np.append(rest + a, rest - a)), 2)
        edges = np.unique(np.append(lower, upper)).tolist()
        pieces = []
        for spring in self.spring:
            cuts = [spring.low, *(x for x in edges if spring.low < x < spring.high), spring.high]
            for low, high in pairwise(cuts):
                up, down = upper <= low, lower >= high
                sticks = ~(up | down)
                held = np.where(sticks, spring.origin, np.where(up, upper, lower))
                c0, c1, c2, c3 = spring.cubic
                cubic = (c0 + float(k @ (held - rest)), c1 + float(k[sticks].sum()), c2, c3)
                slips = int(up.any()) - int(down.any())
                pieces.append(replace(spring, low=low, high=high, cubic=cubic, slips=slips))
        return tuple(pieces)

    @property
    def _start(self) -> np.ndarray:
        return np.zeros(self.elements.count) if self.elongation is None else self.elongation

    @cached_property
    def _knots(self) -> np.ndarray:
        return np.array([piece.high for piece in self.spring[:-1]])

    def _edges(self, angles: np.ndarray) -> np.ndarray:
        """Return angles (k,) moved together where they are hardly apart: no piece is narrower."""
        places = np.append(self.angle, self._knots)
        for k, angle in enumerate(angles):
            near = places[np.abs(places - angle).argmin()]
            if abs(near - angle) < _NARROW:
                angles[k] = near
            else:
                places = np.append(places, angle)
        return angles

    def turned(self, angle: float) -> GearLaw:
        """Return the law from a wind-up on at which the gear turns back, moved if hardly off a bend."""
        if len(self._knots):
            near = self._knots[np.abs(self._knots - angle).argmin()]
            angle = float(near) if abs(near - angle) < _NARROW else angle
        a = self.elements.slip_angle
        elongation = np.clip(self._start + (angle - self.angle), -a, a)
        return GearLaw(self.spring, self.elements, angle, elongation)
