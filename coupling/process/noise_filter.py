"""Low-passes that take noise off forces without delay."""

from __future__ import annotations

from abc import ABC, abstractmethod
from dataclasses import dataclass, replace
from itertools import pairwise

import numpy as np

from coupling.path.histories import ToolPath, WrenchHistory
from coupling.path.interpolation import InterpolatedPath
from coupling.path.low_pass import low_pass, noise_share

# Ratio of neighbouring cutoffs, and how many standard deviations of its noise a force may be off by.
_RATIO, _BAND = float(np.sqrt(2.0)), 2.5
# Fewest rows between two jumps that a filter works on.
_FEWEST = 12


def own_frequency(path: ToolPath) -> float:
    """Return the frequency of a motion's fastest changes [Hz].

    Of a sine with the path's largest speed v and acceleration a it is a / (2 pi v).

    Args:
        path: Path of the tools, in short steps.

    Returns:
        The largest of all tools; 0 of tools that stand.
    """
    frequency = 0.0
    for tool in path.tools:
        between = InterpolatedPath(tool)
        speed, acceleration = (
            float(np.linalg.norm(between.position(path.time, order), axis=1).max())
            for order in (1, 2)
        )
        if speed > 0.0:
            frequency = max(frequency, acceleration / (2.0 * np.pi * speed))
    return frequency


class ForceFilter(ABC):
    """Filter that takes noise off a force: a low-pass of zero phase."""

    cutoff: float

    @abstractmethod
    def smoothed(self, time: np.ndarray, values: np.ndarray, noise: np.ndarray) -> np.ndarray:
        """Return a history without its noise.

        Args:
            time: Rising times [s], (n,).
            values: Values, any unit, (n, k).
            noise: Standard deviation of white noise in each column, in its unit, (k,).
        """

    def of(self, wrench: WrenchHistory, noise: np.ndarray) -> WrenchHistory:
        """Return wrenches without their noise; what jumps keeps its jumps.

        Args:
            noise: Standard deviation of white noise in them [N, N m], (tools, 6).
        """
        filtered = wrench.wrench.copy()
        jumps = np.flatnonzero(np.diff(wrench.time) == 0.0) + 1
        ends = [0, *jumps, len(wrench.time)]
        for a, b in pairwise(ends):
            if b - a < _FEWEST:
                continue
            for tool, tool_noise in enumerate(noise):
                filtered[tool, a:b] = self.smoothed(
                    wrench.time[a:b], wrench.wrench[tool, a:b], tool_noise
                )
        return replace(wrench, wrench=filtered)


@dataclass(frozen=True)
class LowPass(ForceFilter):
    """One cutoff along the whole path.

    Attributes:
        cutoff: Cutoff frequency [Hz].
    """

    cutoff: float

    def smoothed(self, time: np.ndarray, values: np.ndarray, noise: np.ndarray) -> np.ndarray:
        """Return values (n, k) of any unit at times (n,) [s], below the cutoff."""
        return low_pass(time, values, self.cutoff)

    def __str__(self) -> str:
        return f"low-passed at {self.cutoff:.3g} Hz"


@dataclass(frozen=True)
class AdaptiveLowPass(ForceFilter):
    """Cutoffs that are as low as the noise explains: higher where the force changes faster.

    At every time it is the lowest cutoff from which on all differ by less than bands of the noise that
    they let through, the intersection of confidence intervals of [Goldenshluger1997].

    Attributes:
        cutoff: The lowest one [Hz].
    """

    cutoff: float

    def smoothed(self, time: np.ndarray, values: np.ndarray, noise: np.ndarray) -> np.ndarray:
        """Return values (n, k) of any unit without what noise (k,) explains; as they are without."""
        from scipy.ndimage import maximum_filter1d, uniform_filter1d

        fastest = 0.5 / float(np.median(np.diff(time)))
        count = int(np.ceil(np.log(fastest / self.cutoff) / np.log(_RATIO))) if self.cutoff else 0
        if count < 1 or not np.any(noise > 0.0):
            return values
        cutoffs = self.cutoff * _RATIO ** np.arange(count)
        tried = np.stack([*(low_pass(time, values, cutoff) for cutoff in cutoffs), values])
        through = [*(noise_share(cutoff, fastest) for cutoff in cutoffs), 1.0]
        band = _BAND * np.sqrt(through)[:, None, None] * noise
        low = np.maximum.accumulate((tried - band)[::-1])[::-1]
        high = np.minimum.accumulate((tried + band)[::-1])[::-1]
        agree = np.logical_and.accumulate((low <= high)[::-1])[::-1]
        chosen = np.argmax(agree, axis=0).astype(float)
        # From one cutoff to another within a quarter of the lowest one's period.
        width = max(int(0.25 / self.cutoff * len(time) / (time[-1] - time[0])), 1)
        chosen = uniform_filter1d(maximum_filter1d(chosen, width, axis=0), width, axis=0)
        below = chosen.astype(int).clip(max=count - 1)
        share = chosen - below
        at = np.arange(len(time))[:, None], np.arange(values.shape[1])
        smooth: np.ndarray = (1.0 - share) * tried[below, *at] + share * tried[below + 1, *at]
        return smooth

    def __str__(self) -> str:
        return f"low-passed at {self.cutoff:.3g} Hz, higher where it changes by more than noise explains"
