"""Prewhitening of residuals: what the model does not describe is slow, and counts as correlated noise.

    S(f) = n + 4 s^2 / (2 pi f_0) / (1 + (f / f_0)^2)

is the spectrum of measurement noise n and of a first-order Markov process of standard deviation s, which
stands for hysteresis, drift and gear errors.  Rows divided by sqrt(S / n) are as independent as those of
noise, so that the times at which gears cross their backlash count beside deviations that are larger.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import cached_property
from itertools import product, starmap

import numpy as np
from scipy.fft import dct, idct

from coupling.identification.runs.slow_part import CUT_OFF, SlowPart


@dataclass(frozen=True)
class UnmodelledSpectrum:
    """Spectrum of what the model does not describe of the tool's positions.

    Attributes:
        deviation: Standard deviation s of a coordinate [m]; 0: nothing but noise.
        corner: Corner f_0 [Hz].

    Example:
        >>> UnmodelledSpectrum(1e-5, 1.0).density(np.array([0.0, 1.0]))
        array([6.36619772e-11, 3.18309886e-11])
    """

    deviation: float
    corner: float

    def density(self, frequency: np.ndarray) -> np.ndarray:
        """Return its one-sided power spectral density at frequencies [Hz], [m^2/Hz], (f,)."""
        low = 2.0 * self.deviation**2 / (np.pi * self.corner)
        density: np.ndarray = low / (1.0 + (frequency / self.corner) ** 2)
        return density


# Nothing but noise; and what robots have that no one has measured, some 0.05 mm of it.
NONE, USUAL = UnmodelledSpectrum(0.0, 1.0), UnmodelledSpectrum(6e-5, 0.5)
# Spectra among which the likeliest is chosen; slow ones, up to the usual one, and all.
SLOW_SPECTRA = (NONE, *(replace(USUAL, deviation=s) for s in np.geomspace(5e-6, 6e-5, 5).tolist()))
SPECTRA = (
    NONE,
    *starmap(
        UnmodelledSpectrum, product(np.geomspace(1e-6, 3e-4, 11).tolist(), (0.1, 0.3, 1.0, 3.0))
    ),
)


@dataclass(frozen=True)
class Whitening:
    """Filter of zero phase that makes rows of a slow part as independent as noise alone would be.

    Times between rows are taken as even; a gap in a measurement counts as none.

    Attributes:
        slow: The slow part.
        noise: Standard deviation of a sample's noise [m].
    """

    slow: SlowPart
    noise: float

    @cached_property
    def frequency(self) -> np.ndarray:
        """Frequencies of the cosine transform [Hz], (k,)."""
        count = len(self.slow.time)
        frequency: np.ndarray = np.arange(count) / (2.0 * count * self._step)
        return frequency

    @property
    def _step(self) -> float:
        return float(np.median(np.diff(self.slow.time)))

    @property
    def _noise_density(self) -> float:
        """One-sided power spectral density of the noise [m^2/Hz]."""
        return 2.0 * self.noise**2 * float(np.median(np.diff(self.slow.samples)))

    def excess(self, spectrum: UnmodelledSpectrum) -> np.ndarray:
        """Return S / n at the frequencies [1], (k,)."""
        excess: np.ndarray = 1.0 + spectrum.density(self.frequency) / self._noise_density
        return excess

    def __call__(self, rows: np.ndarray, spectrum: UnmodelledSpectrum) -> np.ndarray:
        """Return rows of any unit, (k, ...), divided by the root of S / n."""
        if spectrum.deviation == 0.0:
            return rows
        gain = _along(self.excess(spectrum) ** -0.5, rows)
        whitened: np.ndarray = idct(dct(rows, axis=0, norm="ortho") * gain, axis=0, norm="ortho")
        return whitened

    def transformed(self, rows: np.ndarray) -> np.ndarray:
        """Return the cosine transform of rows [m] up to the cutoff, in deviations of noise, (f, ...)."""
        low = self.frequency <= CUT_OFF
        passed = 0.5 ** (0.5 * (self.frequency / CUT_OFF) ** 2)
        deviation = passed * np.sqrt(self._noise_density / (2.0 * self._step))
        transform: np.ndarray = dct(rows, axis=0, norm="ortho")[low]
        return transform / _along(deviation[low], transform)


def _along(values: np.ndarray, rows: np.ndarray) -> np.ndarray:
    """Return values, (k,), in a shape that multiplies rows, (k, ...)."""
    return values.reshape(-1, *[1] * (rows.ndim - 1))
