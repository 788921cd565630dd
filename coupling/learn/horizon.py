"""How far along the passes a fit looks: a little further than what is found so far explains."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from coupling.learn.smoothing import SlowPart

# What is looked at first [s], by how much more at least, and how far behind where noise ends.
_FIRST, _LEAST, _BEHIND = 1.0, 0.5, 0.5
# By which part more at least where what was looked at stays unexplained, as where a gear is in its
# backlash without load: else a fit that comes to nothing takes longest.
_STRIDE = 0.5
# Means over so long [s] that are so many times noise are no longer explained.
_OVER, _FAR = 0.2, 2.0


def next_horizon(
    slow: Sequence[np.ndarray],
    means: Sequence[SlowPart],
    noise: float,
    before: float,
    explained: bool = True,
) -> float:
    """Return how far to look next [s], of every pass; infinite where all is explained or looked at.

    Args:
        slow: Slow parts of what is left of the passes [m], (k, 3) or (k, 6).
        means: Their times.
        noise: What noise alone would leave of them [m], rms.
        before: How far was looked before [s]; 0 in the beginning.
        explained: Whether that was explained.
    """
    least = _LEAST if explained else max(_LEAST, _STRIDE * before)
    ends = [_explained(rest, mean, noise, before) for rest, mean in zip(slow, means, strict=True)]
    if min(ends) == np.inf:
        return np.inf
    seconds = max(min(ends) + _BEHIND, before + least, _FIRST)
    longest = max(float(np.ptp(mean.time)) for mean in means)
    return seconds if seconds < longest else np.inf


def _explained(rest: np.ndarray, mean: SlowPart, noise: float, before: float) -> float:
    """Return when more than noise is left of a pass for the first time behind what was looked at [s]."""
    since = mean.time - mean.time[0]
    squares = np.sum(rest[:, :3] ** 2, axis=1)
    count = max(1, round(_OVER * len(since) / max(float(since[-1]), _OVER)))
    over = np.convolve(squares, np.ones(count) / count, mode="same") > (_FAR * noise) ** 2
    late = over & (since > before)
    return float(since[np.argmax(late)]) if late.any() else np.inf
