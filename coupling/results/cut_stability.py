"""Whether the cut of a run chatters, where it is worst."""

from __future__ import annotations

from coupling.results.base import ResultPart, Unbounded

# First sentence of whatever is asked about a cut that chatters.
WILL_CHATTER = "This cut will chatter: do not run it."


class CutStability(ResultPart):
    """Stability of the cut along a path, at its worst place.

    Attributes:
        sentence: Verdict and place, in words.
        alternative: Depth and speed that would be stable, in words; empty where the cut is.
    """

    sentence: str
    alternative: str = ""
    stable: bool
    time_s: float | None
    rpm: float
    depth_m: float
    limit_m: Unbounded
    frequency_Hz: float
    growth_1_s: float
