"""Axes of G-code other than X, Y, Z: those of the machine's kinematics move, others stand still."""

from __future__ import annotations

import math
from collections.abc import Iterable, Mapping

from coupling.programs.reading import ReadingNotes
from coupling.toolpaths.rotary import RotaryTable

ROTARY, _SECONDARY = "ABC", "UVW"
OTHER_AXES = frozenset(ROTARY + _SECONDARY)
# No axis turns farther [deg].
_MAX_ANGLE = 1e6


class OtherAxes:
    """Places of the rotary axes A, B, C; of the second linear ones U, V, W only a zero is read.

    An axis that the table names moves, and is at zero until it is given.  Of any other, a value on the
    way to the first point is where it stands; behind it, one that differs is a move.

    Attributes:
        values: Places that were given, by their letters [deg]; replaced, never changed.
    """

    def __init__(self, notes: ReadingNotes, table: RotaryTable | None = None) -> None:
        self._notes = notes
        self._letters = table.kinematics.letters if table else ()
        self._shortest = table.shortest if table else []
        self.values: Mapping[str, float] = {}

    @property
    def angles(self) -> tuple[float, ...]:
        """Angles of the axes that the table names, in its order [rad]."""
        return tuple(math.radians(self.values.get(letter, 0.0)) for letter in self._letters)

    def forget(self, letters: Iterable[str]) -> None:
        """Note axes that return to the machine's reference, before the first move or behind the last."""
        self.values = {key: value for key, value in self.values.items() if key not in letters}

    def assume_zeros(self) -> None:
        """Note which axes of the table are at zero because they were not given before the first move."""
        for letter in self._letters:
            if letter not in self.values:
                self._notes.assume(f"{letter} is at 0 until it is given")

    def take(self, words: dict[str, float], absolute: bool, in_part: bool) -> None:
        """Take the words of these axes out of a line.

        Args:
            words: Words of the line by their letters; they lose these.
            absolute: Whether they are places; otherwise ways.
            in_part: Whether the tool moves in the part, or has moved there.

        Raises:
            ValueError: If an axis moves that the table does not name, or too far.
        """
        for letter in [letter for letter in words if letter in OTHER_AXES]:
            value = words.pop(letter)
            if letter in _SECONDARY:
                if value != 0.0:
                    raise ValueError(
                        f"expected X, Y, Z, got {letter}{value:g}, a second linear axis or an increment:"
                        " post-process for three axes"
                    )
                self._notes.leave_out(f"{letter}0")
            elif letter in self._letters:
                self._turn(letter, value, absolute, in_part)
            else:
                self._stand(letter, value, absolute, in_part)

    def _turn(self, letter: str, value: float, absolute: bool, in_part: bool) -> None:
        if letter not in self.values and in_part:
            self._notes.assume(f"{letter} is at 0 until it is given")
        before = self.values.get(letter, 0.0)
        way = value - before if absolute else value
        if absolute and letter in self._shortest:
            way = math.remainder(way, 360.0)
        elif absolute and abs(way) > 180.0 and in_part:
            self._notes.assume(
                f"{letter} turns by more than 180 deg in a move, as written; where the control goes the"
                f' shortest way, write shortest = ["{letter}"] in [tool_path.rotary]'
            )
        if not abs(before + way) <= _MAX_ANGLE:
            raise ValueError(f"{letter}: expected at most {_MAX_ANGLE:g} deg, got {value:g}")
        if self.values.get(letter) != before + way:
            self.values = {**self.values, letter: before + way}

    def _stand(self, letter: str, value: float, absolute: bool, in_part: bool) -> None:
        before = self.values.get(letter, 0.0)
        place = value if absolute else before + value
        if in_part and place != before:
            raise ValueError(
                f"expected the rotary axis {letter} to stand still at {before:g}, got"
                f" {letter}{value:g}: name the machine's axes in [tool_path.rotary], or post-process"
                " for three axes"
            )
        if self.values.get(letter) != place:
            self.values = {**self.values, letter: place}
        self._notes.leave_out(f"{letter}{place:g}, a rotary axis that stands still")
