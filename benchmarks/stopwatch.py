"""How long a run takes; imports nothing of the project."""

from __future__ import annotations

import time
from collections.abc import Callable

import numpy as np

# A run shorter than this [s] is repeated, and the best of three counts.
_SHORT = 5.0


def timed(
    run: Callable[[], np.ndarray], clock: Callable[[], float] = time.perf_counter
) -> tuple[float, np.ndarray]:
    """Return the time [s] of a run, the best of three if it is short, and what it returned.

    Args:
        run: What is timed.
        clock: Tells the time [s]: wall time, or that of this process on its core.
    """
    best = np.inf
    for _ in range(3):
        start = clock()
        values = run()
        best = min(best, clock() - start)
        if best > _SHORT:
            break
    return best, values
