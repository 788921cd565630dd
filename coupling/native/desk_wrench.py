"""A wrench as links on nodes can feel it, in C (`desk/smooth_wrench.h`)."""

from __future__ import annotations

import ctypes

import numpy as np

from coupling.native.desk_library import loaded_library
from coupling.native.desk_robot import address, finite_numbers, numbers

_AXES = 6
# Cells of a grid in the width of a mean, and so many of them that their numbers are exact.
_CELLS, _MOST_CELLS = 16, 1e15


class _History(ctypes.Structure):
    """er_wrench_history of desk/smooth_wrench.h."""

    _fields_ = (
        ("count", ctypes.c_int64),
        ("cell", ctypes.c_double),
        *((name, ctypes.c_void_p) for name in ("instants", "before", "behind")),
    )


class DeskWrench:
    """A wrench of a tool, smoothed.

    Args:
        instants: Rising times [s], (k,), at least two, between which the wrench is straight.
        before, behind: Wrench just before and just behind each [N, N m], (k, 6).
        width: Width of a mean [s].

    Raises:
        ValueError: If an array has another shape than the others ask for, is not finite or does not
            rise, or the width is no part of the duration.
    """

    def __init__(
        self, instants: np.ndarray, before: np.ndarray, behind: np.ndarray, width: float
    ) -> None:
        count, cell = len(instants), width / _CELLS
        arrays = (
            finite_numbers("instants", instants, (count,)),
            finite_numbers("wrenches", before, (count, _AXES)),
            finite_numbers("wrenches", behind, (count, _AXES)),
        )
        if count < 2 or not (np.diff(arrays[0]) > 0.0).all():
            raise ValueError("expected two or more instants that rise")
        if not (arrays[0][-1] - arrays[0][0]) / _MOST_CELLS < cell < np.inf:
            raise ValueError(f"expected the width of a mean in seconds, got {width}")
        self._arrays, self._history = arrays, _History(count, cell, *map(address, arrays))

    def at(self, times: np.ndarray) -> np.ndarray:
        """Return the smoothed wrenches at times (k,) [s], (k, 6)."""
        instants = numbers("times", times, (len(times),))
        wrench = np.empty((len(instants), _AXES))
        loaded_library().er_smooth_wrench(
            ctypes.byref(self._history),
            ctypes.c_int64(len(instants)),
            address(instants),
            address(wrench),
        )
        return wrench
