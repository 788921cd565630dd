"""How long a run takes; imports nothing of the project."""

from __future__ import annotations

import time
from collections.abc import Callable

import numpy as np

# A run shorter than this [s] is repeated: three times, and again until all took so long [s] together, so
# that a run of milliseconds does not fall into one disturbance as a whole.
_SHORT, _TOGETHER = 5.0, 2.0


def timed(run: Callable[[], np.ndarray]) -> tuple[float, np.ndarray]:
    """Return the time [s] of a run, the best of several if it is short, and what it returned.

    The time is that of this process on its core, which other work on the machine lengthens less than
    wall time.
    """
    best, spent, runs = np.inf, 0.0, 0
    while runs < 1 or (best <= _SHORT and (runs < 3 or spent < _TOGETHER)):
        start = time.process_time()
        values = run()
        took = time.process_time() - start
        best, spent, runs = min(best, took), spent + took, runs + 1
    return best, values
