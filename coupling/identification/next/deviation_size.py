"""How large a deviation is, without the noise that it was measured with."""

from __future__ import annotations

import numpy as np

from coupling.identification.runs.slow_part import SlowPart
from coupling.path.deviation import less_constant, root_mean_square
from coupling.results.next_result import DeviationSize

# No mode that a robot of this size is moved in is faster [Hz].
_SIGNAL = 15.0
# Above it there is noise alone, but where there is more than so many standard deviations of it and this
# rms [m], up to this frequency [Hz]: gears that strike.
_CHANCE, _LEAST_FAST, _FASTEST = 4.0, 2e-6, 60.0
# Relative standard deviation of the estimate of a noise.
_NOISE_DEVIATION = 0.015


def signal_filter(time: np.ndarray) -> SlowPart:
    """Return the low-pass above which a measurement is taken to have noise alone.

    Args:
        time: Times of its samples [s], (n,).
    """
    return SlowPart.of(time, min(_SIGNAL, 0.25 * _rate(time)))


def deviation_size(time: np.ndarray, deviation: np.ndarray, noise: float) -> DeviationSize:
    """Return the size of deviations.

    Args:
        time: Times, rising [s], (n,).
        deviation: Deviations [m], (n, 3).
        noise: Standard deviation of a coordinate's noise [m].
    """
    low_pass = signal_filter(time)
    slow = low_pass(deviation)
    noise_square = 3.0 * noise**2 * low_pass.of_noise
    doubt = noise_square * _relative_deviation(low_pass)
    fast_square = _fast_square(time, deviation, noise, low_pass)
    largest, rms = [], []
    for part in (slow, less_constant(low_pass.time, slow)):
        distance = np.linalg.norm(part, axis=1)
        largest.append(float(distance.max()))
        square = root_mean_square(low_pass.time, distance) ** 2 - noise_square + fast_square
        rms.append(float(np.sqrt(max(square, 0.0))))
    return DeviationSize(largest[0], rms[0], largest[1], rms[1], doubt, float(np.sqrt(fast_square)))


def _rate(time: np.ndarray) -> float:
    return (len(time) - 1) / float(np.ptp(time))


def _relative_deviation(low_pass: SlowPart) -> float:
    """Return the relative standard deviation of a mean square of noise behind a low-pass."""
    independent = 3.0 * len(low_pass.time) * low_pass.independent
    return float(np.hypot(np.sqrt(2.0 / independent), 2.0 * _NOISE_DEVIATION))


def _fast_square(
    time: np.ndarray, deviation: np.ndarray, noise: float, low_pass: SlowPart
) -> float:
    """Return the mean square of what is faster than a low-pass [m^2], if it is more than noise; else 0.

    Args:
        time: Times [s], (n,).
        deviation: Deviation [m], (n, 3).
        noise: Standard deviation of a coordinate's noise [m].
    """
    wide = SlowPart.of(time, min(_FASTEST, 0.25 * _rate(time)))
    squares = [np.mean(np.sum(part(deviation) ** 2, axis=1)) for part in (low_pass, wide)]
    noise_square = 3.0 * noise**2 * (wide.of_noise - low_pass.of_noise)
    square = float(squares[1] - squares[0]) - noise_square
    chance = _CHANCE * noise_square * _relative_deviation(wide)
    return square if square > max(chance, _LEAST_FAST**2) else 0.0
