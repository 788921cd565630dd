"""Low-passes without delay, of rows at even times and of histories at uneven ones."""

from __future__ import annotations

import numpy as np

from coupling.path.linear import interpolate_rows

# Even times for each step of uneven ones at most.
_MOST_EVEN = 4
# Part of a sample that is rounding.
_ROUNDING = 1e-6
# Integral of 1 / (1 + x^4)^2 over x > 0: the band of the filter, over its cutoff.
_BAND = 3.0 * np.pi / (8.0 * np.sqrt(2.0))


def low_pass(time: np.ndarray, values: np.ndarray, cutoff: float, order: int = 2) -> np.ndarray:
    """Return the part of a history below a frequency, without delay, zero rates at the ends kept.

    Butterworth's, forwards and backwards.

    Args:
        time: Rising times [s], (n,); the filter works on even times as near as the nearest of these,
            straight pieces in between.
        values: Values, any unit, (n, k).
        cutoff: Cutoff frequency [Hz]; nothing is taken off where samples are too far apart for it.
        order: Order of the filter in one direction.
    """
    duration, steps = float(time[-1] - time[0]), np.diff(time)
    count = min(round(duration / steps.min()), _MOST_EVEN * len(steps))
    even = np.linspace(time[0], time[-1], count + 1)
    rate = count / duration
    if cutoff >= 0.5 * rate:
        return values
    resampled = interpolate_rows(even, time, values)
    return interpolate_rows(time, even, zero_phase(resampled, duration / count, cutoff, order))


def zero_phase(
    values: np.ndarray,
    step: float,
    cutoff: float,
    order: int = 2,
    padtype: str = "even",
    periods: float = 3.0,
) -> np.ndarray:
    """Return columns, (n, k), any unit, without what is faster than a cutoff; in phase.

    A Butterworth filter runs forwards and backwards over the rows.

    Args:
        values: Rows at equal times, (n, k), any unit.
        step: Step of time [s].
        cutoff: Half power of one run [Hz]; at or above half the sampling rate nothing is filtered.
        order: Order of the filter in one direction.
        padtype: Continuation beyond the ends: "even" keeps zero rates there, "odd" the rates.
        periods: Length of the continuation, in periods of the cutoff.

    Example:
        >>> time = 0.004 * np.arange(1000)
        >>> slow = np.sin(2.0 * np.pi * 1.0 * time)[:, None]
        >>> bool(np.abs(zero_phase(slow, 0.004, 20.0) - slow)[100:-100].max() < 1e-4)
        True
    """
    from scipy.signal import butter, sosfiltfilt

    if cutoff >= 0.5 / step:
        return values
    sections = butter(order, cutoff, fs=1.0 / step, output="sos")
    length = min(len(values) - 1, int(periods / (cutoff * step) + _ROUNDING))
    filtered: np.ndarray = sosfiltfilt(sections, values, axis=0, padtype=padtype, padlen=length)
    return filtered


def noise_share(cutoff: float, fastest: float) -> float:
    """Return the share of the variance of white noise that `low_pass` lets through.

    Its gain is 1 / (1 + (f / cutoff)^4), forwards and backwards together.

    Args:
        cutoff: Cutoff frequency [Hz].
        fastest: Half the rate of the samples, up to which the noise is white [Hz].
    """
    return min(_BAND * cutoff / fastest, 1.0)
