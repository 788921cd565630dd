"""Elements of one gear's hysteresis, in C (`desk/elements.h`)."""

from __future__ import annotations

import ctypes

import numpy as np

from coupling.native.desk_library import loaded_library
from coupling.native.desk_robot import address, finite_numbers, numbers


class _Elements(ctypes.Structure):
    """er_gear_elements of desk/gear_path.h."""

    _fields_ = (
        ("count", ctypes.c_int64),
        *((name, ctypes.c_void_p) for name in ("slip_torque", "slip_angle")),
    )


class DeskElements:
    """Elements of a gear.

    Args:
        slip_torque: Torque at which each slips [N m], (e,).
        slip_angle: Elongation at which it does [rad], (e,), > 0.

    Attributes:
        count: Their number.
        struct: They as C has them.

    Raises:
        ValueError: If an array has another shape than the other one, is not finite, or an angle not > 0.
    """

    def __init__(self, slip_torque: np.ndarray, slip_angle: np.ndarray) -> None:
        self.count = len(slip_angle)
        # The arrays stay as long as C reads them.
        self._read = (
            finite_numbers("slip torques", slip_torque, (self.count,)),
            finite_numbers("slip angles", slip_angle, (self.count,)),
        )
        if (self._read[1] <= 0.0).any():
            raise ValueError("expected slip angles above zero")
        self.struct = _Elements(self.count, *map(address, self._read))

    def along(self, wind_up: np.ndarray, start: np.ndarray) -> np.ndarray:
        """Return the elongations along a path [rad], (n, e).

        Args:
            wind_up: Wind-up [rad], (n,), n > 0, between which it moves one way.
            start: Elongations at the first of them [rad], (e,).
        """
        path = numbers("wind-ups", wind_up, (len(wind_up),))
        begin, elongation = (
            numbers("elongations", start, (self.count,)),
            np.empty((len(path), self.count)),
        )
        if elongation.size:
            loaded_library().er_elements_along(
                ctypes.byref(self.struct),
                ctypes.c_int64(len(path)),
                *map(address, (path, begin, elongation)),
            )
        return elongation
