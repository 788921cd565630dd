"""What is slow of samples at any times: local means, the same of a measurement and of its model."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np
from scipy.sparse import csr_array

# Frequency up to which measurement and model are compared [Hz]: above it the robot's own modes begin,
# whose phase is decided by everything before.
CUT_OFF = 5.0
# Standard deviation of a Gaussian in time that leaves 1/sqrt(2) of this frequency [s Hz].
_WIDTH = np.sqrt(np.log(2.0)) / (2.0 * np.pi)
# The Gaussian ends after so many of them; means are so many apart.
_REACH, _APART = 3.5, 1.0
# A mean over less than this part of the samples that a full one has is none.
_FEWEST = 0.3


@dataclass(frozen=True)
class SlowPart:
    """Means of samples around evenly spaced times, weighted by a Gaussian.

    Attributes:
        samples: Times of the samples, rising [s], (n,).
        time: Times of the means [s], (k,).
        weights: Weights of the samples in them, (k, n); rows sum to 1.
    """

    samples: np.ndarray
    time: np.ndarray
    weights: csr_array

    @classmethod
    def of(cls, samples: np.ndarray, cut_off: float = CUT_OFF) -> SlowPart:
        """Return the means for samples at given times.

        Args:
            samples: Times of the samples, rising [s], (n,).
            cut_off: Frequency of which 1/sqrt(2) is left [Hz].
        """
        width = float(_WIDTH) / cut_off
        count = max(1, round((samples[-1] - samples[0]) / (_APART * width)))
        time = np.linspace(samples[0], samples[-1], count + 1)
        first = np.searchsorted(samples, time - _REACH * width)
        last = np.searchsorted(samples, time + _REACH * width)
        many = last - first
        filled = many > _FEWEST * np.median(many)
        time, first, many = time[filled], first[filled], many[filled]
        row = np.repeat(np.arange(len(time)), many)
        within = np.arange(len(row)) - np.repeat(np.cumsum(many) - many, many)
        column = np.repeat(first, many) + within
        weight = np.exp(-0.5 * ((samples[column] - time[row]) / width) ** 2)
        weight /= np.bincount(row, weight)[row]
        shape = (len(time), len(samples))
        return cls(samples, time, csr_array((weight, (row, column)), shape=shape))

    def __call__(self, values: np.ndarray) -> np.ndarray:
        """Return the means of values (n, ...), (k, ...)."""
        flat = self.weights @ values.reshape(len(values), -1)
        return flat.reshape(len(self.time), *values.shape[1:])

    @cached_property
    def of_noise(self) -> float:
        """Variance of a mean by that of white noise in the samples."""
        return float(np.mean(self.weights.power(2).sum(axis=1)))

    @cached_property
    def independent(self) -> float:
        """Part of a mean that is independent of its neighbours."""
        # A Gaussian of standard deviation s averages white noise as a box of 2 sqrt(pi) s does.
        return min(1.0, _APART / (2.0 * np.sqrt(np.pi)))
