"""Range in which a number of a case or robot file usually is."""

from __future__ import annotations

from dataclasses import dataclass


@dataclass(frozen=True)
class UsualRange:
    """Range in which the magnitude of a value usually is.

    Attributes:
        low, high: Its ends.
        unit: Unit of both; "" for a number without one.
        why: Things that have these values.
        or_none: Whether 0 says that there is none of it, which is usual as well.
    """

    low: float
    high: float
    unit: str
    why: str
    or_none: bool = False

    def holds(self, value: float) -> bool:
        """Return whether a value is usual."""
        return self.low <= abs(value) <= self.high or (self.or_none and value == 0.0)
