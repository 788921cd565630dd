"""The wrench on a tool as links on nodes can feel it."""

from __future__ import annotations

import numpy as np

from coupling.native.desk_wrench import DeskWrench
from coupling.path.histories import WrenchHistory


class SmoothWrench:
    """A wrench without what is faster than nodes can follow, continuous in time.

    A wrench that jumps asks for links whose acceleration jumps.  Smoothed with a kernel K it moves the
    links to the same place at the same rate behind the jump if K has no first and second moment:
    K = 2 b^2 - b^4, with b the mean over a distance of nodes, repeated.  Of a frequency f it leaves
    1 - (1 - s)^2 with s = sinc^2(f width), little of the teeth of a mill.

    Args:
        history: Wrench on one tool; beyond its ends the outermost row acts.
        width: Distance of the nodes [s].

    Example:
        >>> force = np.array([[0.0, 0, 0], [0, 0, 0], [8, 0, 0]])
        >>> step = WrenchHistory.of_forces(np.array([0.0, 1.0, 1.0]), [force])
        >>> SmoothWrench(step, 0.2)(np.array([0.5, 1.0, 1.5]))[:, 0].round(9)
        array([0., 4., 8.])
    """

    def __init__(self, history: WrenchHistory, width: float) -> None:
        self._in_c = DeskWrench(history.instants, history.before[0], history.behind[0], width)

    def __call__(self, times: np.ndarray) -> np.ndarray:
        """Return the smoothed wrenches at times (k,) [s], (k, 6)."""
        return self._in_c.at(times)
