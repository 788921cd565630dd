"""Axes of G-code other than X, Y, Z: they stand still."""

from __future__ import annotations

from collections.abc import Mapping

from coupling.programs.reading import ReadingNotes

ROTARY, _SECOND = "ABC", "UVW"
OTHERS = frozenset(ROTARY + _SECOND)


class OtherAxes:
    """Places of the rotary axes A, B, C; of the second linear ones U, V, W only a zero is read.

    A value on the way to the first point is where an axis stands; behind it, one that differs is a move.

    Attributes:
        values: Places that were given, by their letters, as in the program; replaced, never changed.
    """

    def __init__(self, notes: ReadingNotes) -> None:
        self._notes = notes
        self.values: Mapping[str, float] = {}

    def forget(self) -> None:
        """Note a return to the machine's reference, before the first move or behind the last."""
        self.values = {}

    def take(self, words: dict[str, float], absolute: bool, in_part: bool) -> None:
        """Take the words of these axes out of a line.

        Args:
            words: Words of the line by their letters; they lose these.
            absolute: Whether they are places; otherwise ways.
            in_part: Whether the tool moves in the part, or has moved there.

        Raises:
            ValueError: If such an axis moves.
        """
        for letter in [letter for letter in words if letter in OTHERS]:
            value = words.pop(letter)
            if letter in _SECOND:
                if value != 0.0:
                    raise ValueError(
                        f"expected X, Y, Z, got {letter}{value:g}, a second linear axis or an increment:"
                        " post-process for three axes"
                    )
                self._notes.leave_out(f"{letter}0")
                continue
            before = self.values.get(letter, 0.0)
            place = value if absolute else before + value
            if in_part and place != before:
                raise ValueError(
                    f"expected the rotary axis {letter} to stand still at {before:g}, got"
                    f" {letter}{value:g}: post-process for three axes"
                )
            if self.values.get(letter) != place:
                self.values = {**self.values, letter: place}
            self._notes.leave_out(f"{letter}{place:g}, a rotary axis that stands still")
