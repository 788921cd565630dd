"""What is stored of every estimated parameter."""

from __future__ import annotations

from coupling.results.base import ResultPart


class EvidenceResult(ResultPart):
    """What the tests of a tilt or backlash say."""

    F: float | None
    probability: float | None
    left_out_change: float | None
    left_out_change_without_worst: float | None
    supported: bool
    in_words: str


class ParameterResult(ResultPart):
    """An estimated parameter; None is infinite, not fitted, or not in the start or the new file."""

    sparse = ("term", "support")

    name: str
    unit: str
    start: float | None
    value: float | None
    low: float | None
    high: float | None
    written: float | None
    identified: bool
    reason: str
    added: bool = False
    term: str | None = None
    support: EvidenceResult | None = None
