"""Hysteresis of one gear: its elements along a path."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np

from coupling.native.desk_elements import DeskElements
from elastic_robot.hysteresis import Elements
from elastic_robot.parameters import Parameters


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

    @cached_property
    def in_c(self) -> DeskElements:
        """They in C."""
        return DeskElements(self.slip_torque, self.slip_angle)

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
        return self.in_c.along(wind_up, start)

    def torque(self, elongation: np.ndarray) -> np.ndarray:
        """Return the torque of all of them [N m], (...), at elongations (..., e)."""
        return elongation @ self.stiffness

    def slope(self, elongation: np.ndarray) -> np.ndarray:
        """Return the stiffness of those that stick [N m/rad], (...), at elongations (..., e)."""
        return (np.abs(elongation) < self.slip_angle) @ self.stiffness


NO_ELEMENTS = GearElements(np.zeros(0), np.zeros(0))
