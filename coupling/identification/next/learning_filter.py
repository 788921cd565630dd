"""Filter of learning along the path: Q = 1 - (1 - G)^2, of zero phase, for a Gaussian G.

Twicing [Tukey1977]: what the Gaussian leaves of a deviation is filtered by it once more, so that nearly
all of a deviation below the cutoff is learned at once, and no more than before of one at the modes.
"""

from __future__ import annotations

import numpy as np
from scipy.ndimage import gaussian_filter1d

# Cutoff of Q, at which it is 1/sqrt(2), by that of G; there G is 1 - sqrt(1 - 1/sqrt(2)).
_WIDER = float(np.sqrt(-np.log2(1.0 - np.sqrt(1.0 - np.sqrt(0.5))) / 0.5))
# Standard deviation of a Gaussian in time by its cutoff [s Hz].
_WIDTH = float(np.sqrt(np.log(2.0)) / (2.0 * np.pi))


def passed(frequency: np.ndarray, cutoff: float) -> np.ndarray:
    """Return Q at frequencies [Hz], (f,), for its cutoff [Hz].

    Example:
        >>> passed(np.array([0.0, 1.0, 2.0, 4.0]), 2.0).round(3)
        array([1.   , 0.969, 0.707, 0.087])
    """
    gaussian = 0.5 ** (0.5 * (_WIDER * frequency / cutoff) ** 2)
    share: np.ndarray = 1.0 - (1.0 - gaussian) ** 2
    return share


def width_in_time(cutoff: float) -> float:
    """Return the standard deviation of G [s] for the cutoff of Q [Hz]."""
    return _WIDER * _WIDTH / cutoff


def weight_of_sample(step: float, cutoff: float) -> float:
    """Return the weight of one of even samples, a step [s] apart, behind Q at its own time."""
    peak = (2.0 - np.sqrt(0.5)) / (np.sqrt(2.0 * np.pi) * width_in_time(cutoff))
    return float(step * peak)


def low_passed(step: float, values: np.ndarray, cutoff: float) -> np.ndarray:
    """Return values at even times behind Q [m] or any unit, (n, ...); end values hold beyond the ends.

    Args:
        step: Time between them [s].
        values: The values [m] or any unit, (n, ...).
        cutoff: Cutoff of Q [Hz].
    """
    width = width_in_time(cutoff) / step
    smooth = gaussian_filter1d(values, width, axis=0, mode="nearest")
    rest = gaussian_filter1d(values - smooth, width, axis=0, mode="nearest")
    sum_of_both: np.ndarray = smooth + rest
    return sum_of_both
