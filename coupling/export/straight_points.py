"""Few points between which a controller moves straight."""

from __future__ import annotations

import numpy as np

from coupling.export.curves import SampledCurve


def straight_error(
    curve: SampledCurve, time: np.ndarray, tolerance: np.ndarray, start: int, end: int
) -> float:
    """Return how far the straight way from one sample to a later one is off, over the tolerance.

    Args:
        curve: The motion.
        time: Of its samples [s], (n,).
        tolerance: How far the way may be off at the tool at every sample [m], (n,).
        start, end: Rows of the samples.
    """
    if end - start < 2:
        return 0.0
    rows = slice(start + 1, end)
    share = (time[rows] - time[start]) / (time[end] - time[start])
    first, last = (np.repeat(curve.values[k : k + 1], len(share), axis=0) for k in (start, end))
    return float((curve.errors(curve.between(first, last, share), rows) / tolerance[rows]).max())


def straight_points(
    curve: SampledCurve, time: np.ndarray, candidates: np.ndarray, tolerance: np.ndarray
) -> np.ndarray:
    """Return rows of a motion through which straight ways stay within a tolerance.

    From each point the way goes as far as it stays within the tolerance: as far as was found by
    doubling and halving its length, for a longer way may be within it where a shorter one is not.

    Args:
        curve: The motion.
        time: Of its samples [s], (n,).
        candidates: Rows that may be points, rising, with the first and the last one, (m,).
        tolerance: How far the way may be off at the tool at every sample [m], (n,).

    Returns:
        Chosen rows, rising.  From a candidate to the next one a way is taken whatever it leaves.
    """
    chosen, last, reach = [0], len(candidates) - 1, 1

    def fits(steps: int) -> bool:
        rows = candidates[chosen[-1]], candidates[chosen[-1] + steps]
        return straight_error(curve, time, tolerance, *rows) <= 1.0

    while chosen[-1] < last:
        left = last - chosen[-1]
        good, bad = 1, left + 1
        step = min(max(reach, 2), left)
        while good < step < bad:
            if fits(step):
                good, step = step, min(2 * step, left)
            else:
                bad = step
        while bad - good > 1:
            middle = (good + bad) // 2
            if fits(middle):
                good = middle
            else:
                bad = middle
        chosen.append(chosen[-1] + good)
        reach = good
    return candidates[chosen]
