"""Feeds of G-code: per minute (G94), or as the inverse of a move's time (G93)."""

from __future__ import annotations

import math
from collections.abc import Callable

from coupling.programs.reading import ReadingNotes
from coupling.toolpaths.bounds import MAX_SPEED, require_within

# No move takes less or more [s].
_MIN_DURATION, _MAX_DURATION = 1e-4, 3.6e5


class Feed:
    """The feed in force, as RS274/NGC has it.

    Per minute it is that of X, Y, Z where they move, else an angle in degrees: the root of the sum of
    squares of the angles that the rotary axes turn by.  As an inverse of time, F 1/min, it holds for the
    move of its line alone.
    """

    def __init__(self, notes: ReadingNotes) -> None:
        self._notes = notes
        self._is_inverse = False
        self._value: float | None = None
        self._unit: float | None = None

    def begin_line(self) -> None:
        """Forget the feed of the line before where each line has its own."""
        if self._is_inverse:
            self._value = None

    def set_mode(self, value: float) -> None:
        """Take G93 or G94; where one ends the other, F has to be given anew."""
        is_inverse = value == 93.0
        if not is_inverse and not self._is_inverse:
            self._notes.leave_out("G94")
        elif is_inverse != self._is_inverse:
            self._value, self._is_inverse = None, is_inverse

    def set(self, value: float, length: Callable[[float], float]) -> None:
        """Take an F.

        Args:
            value: As written.
            length: Function from a length as written to metres.

        Raises:
            ValueError: If no robot moves so fast or so slowly.
        """
        if self._is_inverse:
            seconds = 60.0 / value if value > 0.0 else math.inf
            if not _MIN_DURATION <= seconds <= _MAX_DURATION:
                raise ValueError(
                    f"F: expected a move of {_MIN_DURATION:g} to {_MAX_DURATION:g} s under G93, got"
                    f" F{value:g} 1/min: give 60 over its seconds"
                )
        else:
            self._unit = length(1.0)
            require_within("F", self._unit * value / 60.0, 1e-9, MAX_SPEED, "m/s")
        self._value = value

    def over(self, way: float, turns_in_place: bool) -> float:
        """Return the feed of a move [m/s], or [rad/s] where X, Y, Z stay.

        Args:
            way: Its way [m or rad].
            turns_in_place: Whether X, Y, Z stay.

        Raises:
            ValueError: If there is none.
        """
        if self._value is None:
            where = "in its line, as G93 has it" if self._is_inverse else "before"
            raise ValueError(f"expected a feed F {where}, got none: give it")
        if self._is_inverse:
            return way * self._value / 60.0
        if not turns_in_place:
            return (self._unit or 0.0) * self._value / 60.0
        self._notes.assume("F is in degrees per minute where rotary axes turn and X, Y, Z stay")
        return math.radians(self._value) / 60.0
