"""A low-pass without delay, for histories at uneven times."""

from __future__ import annotations

import numpy as np

from coupling.path.linear import interpolate_rows

# Even times for each step of uneven ones at most.
_MOST_EVEN = 4
# Integral of 1 / (1 + x^4)^2 over x > 0: the band of the filter, over its cutoff.
_BAND = 3.0 * np.pi / (8.0 * np.sqrt(2.0))


def low_pass(time: np.ndarray, values: np.ndarray, cutoff: float) -> np.ndarray:
    """Return the part of a history below a frequency, without delay, zero rates at the ends kept.

    Second-order Butterworth, forwards and backwards.

    Args:
        time: Rising times [s], (n,); the filter works on even times as near as the nearest of these,
            straight pieces in between.
        values: Values, any unit, (n, k).
        cutoff: Cutoff frequency [Hz]; nothing is taken off where samples are too far apart for it.
    """
    from scipy.signal import butter, sosfiltfilt

    duration, steps = float(time[-1] - time[0]), np.diff(time)
    count = min(round(duration / steps.min()), _MOST_EVEN * len(steps))
    even = np.linspace(time[0], time[-1], count + 1)
    rate = count / duration
    if cutoff >= 0.5 * rate:
        return values
    sections = butter(2, cutoff, fs=rate, output="sos")
    padding = min(count, int(3.0 * rate / cutoff))
    resampled = interpolate_rows(even, time, values)
    filtered = sosfiltfilt(sections, resampled, axis=0, padtype="even", padlen=padding)
    return interpolate_rows(time, even, filtered)


def noise_share(cutoff: float, fastest: float) -> float:
    """Return the share of the variance of white noise that `low_pass` lets through.

    Its gain is 1 / (1 + (f / cutoff)^4), forwards and backwards together.

    Args:
        cutoff: Cutoff frequency [Hz].
        fastest: Half the rate of the samples, up to which the noise is white [Hz].
    """
    return min(_BAND * cutoff / fastest, 1.0)
