"""How long a run takes; imports nothing of the project."""

from __future__ import annotations

import time
from collections.abc import Callable

import numpy as np

# A run shorter than this [s] is repeated, and the best of three counts.
_SHORT = 5.0


def timed(run: Callable[[], np.ndarray]) -> tuple[float, np.ndarray]:
    """Return the wall time [s] of a run, the best of three if it is short, and what it returned."""
    best = np.inf
    for _ in range(3):
        start = time.perf_counter()
        values = run()
        best = min(best, time.perf_counter() - start)
        if best > _SHORT:
            break
    return best, values
