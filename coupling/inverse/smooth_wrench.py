"""The wrench on a tool as links on nodes can feel it, in C (`desk/smooth_wrench.h`)."""

from __future__ import annotations

import ctypes

import numpy as np

from coupling.native.desk_library import loaded_library
from coupling.native.desk_robot import address, finite_numbers, numbers
from coupling.path.histories import WrenchHistory

# Cells of a grid in the width of a mean, and so many of them that their numbers are exact.
_CELLS, _MOST_CELLS = 16, 1e15


class _History(ctypes.Structure):
    """er_wrench_history of desk/smooth_wrench.h."""

    _fields_ = (
        ("count", ctypes.c_int64),
        ("cell", ctypes.c_double),
        *((name, ctypes.c_void_p) for name in ("instants", "before", "behind")),
    )


class SmoothWrench:
    """A wrench without what is faster than nodes can follow, continuous in time.

    A wrench that jumps asks for links whose acceleration jumps.  Smoothed with a kernel K it moves the
    links to the same place at the same rate behind the jump if K has no first and second moment:
    K = 2 b^2 - b^4, with b the mean over a distance of nodes, repeated.  Of a frequency f it leaves
    1 - (1 - s)^2 with s = sinc^2(f width), little of the teeth of a mill.

    Args:
        history: Wrench on one tool; beyond its ends the outermost row acts.
        width: Distance of the nodes [s].

    Raises:
        ValueError: If the width is no part of the duration.

    Example:
        >>> force = np.array([[0.0, 0, 0], [0, 0, 0], [8, 0, 0]])
        >>> step = WrenchHistory.of_forces(np.array([0.0, 1.0, 1.0]), [force])
        >>> SmoothWrench(step, 0.2)(np.array([0.5, 1.0, 1.5]))[:, 0].round(9)
        array([0., 4., 8.])
    """

    def __init__(self, history: WrenchHistory, width: float) -> None:
        instants, cell = history.instants, width / _CELLS
        if not (instants[-1] - instants[0]) / _MOST_CELLS < cell < np.inf:
            raise ValueError(f"expected the width of a mean in seconds, got {width}")
        # The arrays stay as long as C reads them.
        self._read = (
            finite_numbers("instants", instants, (len(instants),)),
            finite_numbers("wrenches", history.before[0], (len(instants), 6)),
            finite_numbers("wrenches", history.behind[0], (len(instants), 6)),
        )
        self._history = _History(len(instants), cell, *map(address, self._read))

    def __call__(self, times: np.ndarray) -> np.ndarray:
        """Return the smoothed wrenches at times (k,) [s], (k, 6)."""
        at, wrench = numbers("times", times, (len(times),)), np.empty((len(times), 6))
        loaded_library().er_smooth_wrench(
            ctypes.byref(self._history), ctypes.c_int64(len(at)), address(at), address(wrench)
        )
        return wrench
