"""Hysteresis of one gear: its elements along a path, in C (`desk/elements.h`)."""

from __future__ import annotations

import ctypes
from dataclasses import dataclass
from functools import cached_property

import numpy as np

from coupling.native.desk_library import loaded_library
from coupling.native.desk_robot import address, finite_numbers, numbers
from elastic_robot.hysteresis import Elements
from elastic_robot.parameters import Parameters


class ElementsStruct(ctypes.Structure):
    """er_gear_elements of desk/gear_path.h."""

    _fields_ = (
        ("count", ctypes.c_int64),
        *((name, ctypes.c_void_p) for name in ("slip_torque", "slip_angle")),
    )


@dataclass(frozen=True)
class GearElements:
    """Elements of one gear, e of them.

    Attributes:
        slip_torque: Torque f at which each slips [N m], (e,).
        slip_angle: Elongation a at which it slips [rad], (e,), > 0.

    Raises:
        ValueError: If an array has another shape than the other one, is not finite, or an angle not > 0.

    Example:
        >>> element = GearElements(np.array([40.0]), np.array([2e-5]))
        >>> element.along(np.array([1e-5, 5e-5, 2e-5]), np.zeros(1)).ravel()
        array([ 0.e+00,  2.e-05, -1.e-05])
    """

    slip_torque: np.ndarray
    slip_angle: np.ndarray

    def __post_init__(self) -> None:
        for name in ("slip_torque", "slip_angle"):
            checked = finite_numbers(name, getattr(self, name), self.slip_angle.shape)
            object.__setattr__(self, name, checked)
        if (self.slip_angle <= 0.0).any():
            raise ValueError("expected slip angles above zero")

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
    def struct(self) -> ElementsStruct:
        """They as C has them."""
        return ElementsStruct(self.count, address(self.slip_torque), address(self.slip_angle))

    def __reduce__(self) -> tuple[type[GearElements], tuple[np.ndarray, np.ndarray]]:
        return GearElements, (self.slip_torque, self.slip_angle)

    @property
    def stiffness(self) -> np.ndarray:
        """Stiffness of each while it sticks [N m/rad], (e,)."""
        return self.slip_torque / self.slip_angle

    def along(self, wind_up: np.ndarray, start: np.ndarray) -> np.ndarray:
        """Return the elongations along a path [rad], (n, e).

        Args:
            wind_up: Wind-up [rad], (n,), n > 0, between which it moves one way.
            start: Elongations at the first of them [rad], (e,).
        """
        path = numbers("wind-ups", wind_up, (len(wind_up),))
        begin = numbers("elongations", start, (self.count,))
        elongation = np.empty((len(path), self.count))
        if elongation.size:
            loaded_library().er_elements_along(
                ctypes.byref(self.struct),
                ctypes.c_int64(len(path)),
                *map(address, (path, begin, elongation)),
            )
        return elongation

    def torque(self, elongation: np.ndarray) -> np.ndarray:
        """Return the torque of all of them [N m], (...), at elongations (..., e)."""
        return elongation @ self.stiffness

    def slope(self, elongation: np.ndarray) -> np.ndarray:
        """Return the stiffness of those that stick [N m/rad], (...), at elongations (..., e)."""
        return (np.abs(elongation) < self.slip_angle) @ self.stiffness


NO_ELEMENTS = GearElements(np.zeros(0), np.zeros(0))
