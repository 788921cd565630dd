"""What no robot's program asks for: bounds that tell a mistaken unit from a motion."""

from __future__ import annotations

# No robot goes farther [m], faster [m/s], or waits longer [s].
MAX_DISTANCE, MAX_SPEED, MAX_DWELL = 100.0, 10.0, 3600.0


def require_within(word: str, value: float, low: float, high: float, unit: str) -> float:
    """Return the value of a word, which must be between two bounds, all in a unit.

    Example:
        >>> require_within("F", 0.05, 1e-9, MAX_SPEED, "m/s")
        0.05

    Raises:
        ValueError: If it is not.
    """
    if not low <= value <= high:
        raise ValueError(
            f"{word}: expected {low:g} to {high:g} {unit}, got {value:g} {unit}: look at its unit"
        )
    return value
