"""A gear's law with the elements of its hysteresis, and its path, in C (`desk/gear_path.h`)."""

from __future__ import annotations

import ctypes

import numpy as np

from coupling.native.desk_elements import DeskElements
from coupling.native.desk_library import loaded_library
from coupling.native.desk_robot import address, finite_numbers, numbers


class _Law(ctypes.Structure):
    """er_gear_law of desk/gear_path.h."""

    _fields_ = (
        ("corners", ctypes.c_int64),
        *((name, ctypes.c_void_p) for name in ("angle", "torque", "slope")),
    )


class DeskGear:
    """A gear.

    Args:
        angle: Angles at the corners of its spring's law, rising [rad], (m,).
        torque: Torque there [N m], (m,).
        slope: Slope of each piece, the outer ones endless [N m/rad], (m + 1,).
        elements: Elements of its hysteresis.

    Raises:
        ValueError: If an array has another shape than the others ask for, is not finite, or does not
            rise.
    """

    def __init__(
        self,
        angle: np.ndarray,
        torque: np.ndarray,
        slope: np.ndarray,
        elements: DeskElements,
    ) -> None:
        corners = len(angle)
        law = (
            finite_numbers("angles", angle, (corners,)),
            finite_numbers("torques", torque, (corners,)),
            finite_numbers("slopes", slope, (corners + 1,)),
        )
        if not corners or (np.diff(law[0]) <= 0.0).any():
            raise ValueError("expected rising angles of a law")
        # The arrays stay as long as C reads them.
        self._read, self._room = law, corners + 2 * elements.count
        self._law, self._elements = _Law(corners, *map(address, law)), elements

    def law_from(
        self, start: float, elongation: np.ndarray
    ) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """Return angles (n,) [rad], torques (n,) [N m] and slopes (n + 1,) [N m/rad] with its elements.

        Args:
            start: Wind-up from which on they are followed [rad].
            elongation: Their elongations there [rad], (e,).
        """
        begin = finite_numbers("elongations", elongation, (self._elements.count,))
        angle, torque, slope = np.empty(self._room), np.empty(self._room), np.empty(self._room + 1)
        count = loaded_library().er_gear_law_with_elements(
            ctypes.byref(self._law),
            ctypes.byref(self._elements.struct),
            ctypes.c_double(start),
            *map(address, (begin, angle, torque, slope)),
        )
        return angle[:count].copy(), torque[:count].copy(), slope[: count + 1].copy()

    def path(
        self, spacing: float, torque: np.ndarray, damping: float, start: float
    ) -> tuple[np.ndarray, np.ndarray]:
        """Return wind-up [rad] and its rate [rad/s] at samples, (n,) each.

        Args:
            spacing: Time between samples [s].
            torque: Torque at the samples [N m], (n,), straight in between.
            damping: Damping [N m s/rad], > 0.
            start: Wind-up at the first sample [rad], to which the elements came from unloaded.

        Raises:
            MemoryError: If the law does not fit into memory.
        """
        pulls = numbers("torques", torque, (len(torque),))
        angle, rate = np.empty_like(pulls), np.empty_like(pulls)
        followed = loaded_library().er_gear_path(
            ctypes.byref(self._law),
            ctypes.byref(self._elements.struct),
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


def backlash_changes(
    spacing: float, torque: np.ndarray, backlash: np.ndarray, damping: np.ndarray
) -> np.ndarray:
    """Return how often gears come from flank to flank of their backlash, in which d e' = T, (g,).

    Args:
        spacing: Time between torques [s].
        torque: Torques [N m], (k, g).
        backlash: Half width of the backlash [rad], (g,).
        damping: Damping d [N m s/rad], (g,), > 0.
    """
    count, gears = torque.shape
    changes = np.empty(gears, dtype=np.int64)
    arrays = (
        numbers("torques", torque, (count, gears)),
        numbers("backlash", backlash, (gears,)),
        numbers("damping", damping, (gears,)),
    )
    loaded_library().er_backlash_reversals(
        ctypes.c_int64(count),
        ctypes.c_int64(gears),
        ctypes.c_double(spacing),
        *map(address, (*arrays, changes)),
    )
    return changes
