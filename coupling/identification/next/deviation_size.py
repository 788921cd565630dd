"""How large a deviation is, without the noise that it was measured with."""

from __future__ import annotations

import numpy as np

from coupling.identification.next.smoother import Smoother
from coupling.path.deviation import less_constant, root_mean_square
from coupling.results.next_result import DeviationSize

# No mode that a robot of this size is moved in is faster [Hz].
_SIGNAL = 15.0
# Above it there is noise alone, but where there is more than so many standard deviations of it and this
# rms [m], up to this frequency [Hz]: gears that strike.
_CHANCE, _HARDLY, _FASTEST = 4.0, 2e-6, 60.0
# What the standard deviation of a noise is estimated to, as a part.
_NOISE_OFF = 0.015


def signal_filter(time: np.ndarray) -> Smoother:
    """Return the low-pass above which a measurement is taken to have noise alone.

    Args:
        time: Times of its samples [s], (n,).
    """
    rate = (len(time) - 1) / float(np.ptp(time))
    return Smoother(time, min(_SIGNAL, 0.25 * rate))


def deviation_size(time: np.ndarray, off: np.ndarray, noise: float) -> DeviationSize:
    """Return the size of deviations.

    Args:
        time: Times, rising [s], (n,).
        off: Deviations [m], (n, 3).
        noise: Standard deviation of a coordinate's noise [m].
    """
    low = signal_filter(time)
    slow = low.at_samples(low(off))
    of_noise = 3.0 * noise**2 * low.of_noise
    doubt = of_noise * _share_off(low.cutoff * np.ptp(time))
    fast = _fast(time, off - slow, noise, low)
    largest, rms = [], []
    for own in (slow, less_constant(time, slow)):
        distance = np.linalg.norm(own, axis=1)
        largest.append(float(distance.max()))
        square = root_mean_square(time, distance) ** 2 - of_noise + fast**2
        rms.append(float(np.sqrt(max(square, 0.0))))
    return DeviationSize(largest[0], rms[0], largest[1], rms[1], doubt, fast)


def _share_off(periods: float) -> float:
    """Return by what part a mean square of noise is off, of so many periods of its cutoff."""
    independent = 6.0 * periods
    return float(np.hypot(np.sqrt(2.0 / independent), 2.0 * _NOISE_OFF))


def _fast(time: np.ndarray, rest: np.ndarray, noise: float, low: Smoother) -> float:
    """Return the rms of what a low-pass left over [m], if it is more than noise; else 0.

    Args:
        time: Times [s], (n,).
        rest: Deviation that it left over [m], (n, 3).
        noise: Standard deviation of a coordinate's noise [m].
        low: The low-pass.
    """
    high = Smoother(time, min(_FASTEST, 0.25 * (len(time) - 1) / float(np.ptp(time))))
    if high.cutoff <= low.cutoff:
        return 0.0
    distance = np.linalg.norm(high.at_samples(high(rest)), axis=1)
    # Gain (1 - L) of the one below that of the other, squared.
    of_noise = 3.0 * noise**2 * (high.of_noise - 2.0 * low.trace + low.of_noise)
    more = root_mean_square(time, distance) ** 2 - of_noise
    chance = _CHANCE * of_noise * _share_off((high.cutoff - low.cutoff) * np.ptp(time))
    return float(np.sqrt(more)) if more > max(chance, _HARDLY**2) else 0.0
