"""A low-pass of zero phase for samples at any times, that reaches to their ends."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from math import comb

import numpy as np
from scipy.linalg import solveh_banded
from scipy.sparse import csr_array, diags_array

# Order of the differences that are penalised: behind the cutoff the gain falls with its eighth power, so
# that at two and a half times the cutoff, where a soft robot answers 35 times, a two thousandth is left.
_ORDER = 4
# Nodes a period of the cutoff.
_NODES = 16


@dataclass(frozen=True)
class Smoother:
    """Whittaker's smoother: values at even nodes, straight in between, near the samples and smooth.

    It minimises sum_i (y_i - z(t_i))^2 + w sum (d^4 z)^2, d the difference of neighbours [Eilers2003],
    and for even samples its gain is 1 / (1 + (sin(pi f h) / sin(pi f_c h))^8), h the nodes' distance:
    half at the cutoff, of zero phase.  Nothing is assumed beyond the ends.

    Attributes:
        samples: Times of the samples, rising [s], (n,).
        cutoff: Frequency of which half is left [Hz].

    Example:
        >>> time = np.linspace(0.0, 10.0, 501)
        >>> kept = Smoother(time, 2.0)
        >>> slow = kept(np.sin(2.0 * np.pi * 0.5 * time))
        >>> bool(np.abs(slow - np.sin(2.0 * np.pi * 0.5 * kept.time)).max() < 2e-3)
        True
    """

    samples: np.ndarray
    cutoff: float

    @cached_property
    def time(self) -> np.ndarray:
        """Times of the nodes, from the first sample to the last [s], (k,)."""
        first, last = float(self.samples[0]), float(self.samples[-1])
        count = int(np.ceil((last - first) * _NODES * self.cutoff))
        return np.linspace(first, last, max(count, _ORDER + 1) + 1)

    @property
    def spacing(self) -> float:
        """Distance of the nodes [s]."""
        return float(self.time[1] - self.time[0])

    def __call__(self, values: np.ndarray) -> np.ndarray:
        """Return the smooth part of values (n, c) at the nodes, (k, c)."""
        slow: np.ndarray = solveh_banded(self._bands, self._between.T @ values, lower=True)
        return slow

    def at_samples(self, slow: np.ndarray) -> np.ndarray:
        """Return values at the nodes, (k, c), at the samples, in their unit, (n, c)."""
        values: np.ndarray = self._between @ slow
        return values

    def gain(self, frequency: np.ndarray) -> np.ndarray:
        """Return the share that is left of frequencies [Hz], any shape."""
        ratio = np.sin(np.pi * np.minimum(frequency * self.spacing, 0.5))
        ratio = ratio / np.sin(np.pi * self.cutoff * self.spacing)
        left: np.ndarray = 1.0 / (1.0 + ratio ** (2 * _ORDER))
        return np.where(frequency * self.spacing < 0.5, left, 0.0)

    @property
    def of_noise(self) -> float:
        """Share of the variance of white noise in the samples that is left, away from the ends."""
        return self._over_band(2)

    @property
    def trace(self) -> float:
        """Weight of a sample in its own smooth value, away from the ends."""
        return self._over_band(1)

    def bias(self, values: np.ndarray, noise: float, wide: Smoother) -> float:
        """Return the mean square of what it takes off the signal itself [square of the unit].

        What is taken off below the cutoff of `wide` is signal and noise; with the gains Q and P of both
        white noise of variance s^2 is s^2 tr P^2 (1 - Q)^2 / n of it [Stein1981].  May be negative by
        chance.

        Args:
            values: Samples, in any unit, (n, c).
            noise: Standard deviation of the noise of each, in that unit.
            wide: Smoother of a higher cutoff, above which there is noise alone.
        """
        slow = wide.at_samples(wide(values))
        taken = slow - self.at_samples(self(slow))
        frequency, fastest = self._band
        shown = wide.gain(frequency) ** 2 * (1.0 - self.gain(frequency)) ** 2
        of_noise = float(np.trapezoid(shown, frequency)) / fastest
        return float(np.mean(np.sum(taken**2, axis=1)) - values.shape[1] * noise**2 * of_noise)

    @property
    def _band(self) -> tuple[np.ndarray, float]:
        """Frequencies of the samples, and the largest of them [Hz]."""
        fastest = 0.5 * (len(self.samples) - 1) / float(np.ptp(self.samples))
        return np.linspace(0.0, fastest, 4000), fastest

    def _over_band(self, power: int) -> float:
        """Return the mean of a power of the gain over the frequencies of the samples."""
        frequency, fastest = self._band
        return float(np.trapezoid(self.gain(frequency) ** power, frequency)) / fastest

    @cached_property
    def _between(self) -> csr_array:
        """Weights of the nodes in every sample, (n, k)."""
        place = (self.samples - self.time[0]) / self.spacing
        left = np.clip(place.astype(int), 0, len(self.time) - 2)
        part = place - left
        row = np.arange(len(self.samples))
        rows, columns = np.concatenate([row, row]), np.concatenate([left, left + 1])
        weights = np.concatenate([1.0 - part, part])
        return csr_array((weights, (rows, columns)), shape=(len(row), len(self.time)))

    @cached_property
    def _bands(self) -> np.ndarray:
        """Lower bands of the equations' matrix, (5, k)."""
        count = len(self.time)
        coefficients = [(-1) ** k * comb(_ORDER, k) for k in range(_ORDER + 1)]
        penalty = diags_array(
            [np.full(count - _ORDER, float(own)) for own in coefficients],
            offsets=list(range(_ORDER + 1)),
            shape=(count - _ORDER, count),
        )
        per_node = (len(self.samples) - 1) / (count - 1)
        weight = per_node * (2.0 * np.sin(np.pi * self.cutoff * self.spacing)) ** (-2 * _ORDER)
        matrix = (self._between.T @ self._between + weight * (penalty.T @ penalty)).tocsr()
        bands = np.zeros((_ORDER + 1, count))
        for k in range(_ORDER + 1):
            bands[k, : count - k] = matrix.diagonal(-k)
        return bands
