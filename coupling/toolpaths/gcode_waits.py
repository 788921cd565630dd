"""Waits of a G-code program: G4 by P, by X as FANUC, or by F as Siemens has it."""

from __future__ import annotations

from coupling.programs.reading import ReadingNotes
from coupling.toolpaths.gcode_moves import Dwell
from coupling.toolpaths.gcode_words import require_within

_MAX_DWELL = 3600.0  # no robot waits longer [s]
_DOUBTFUL_DWELL = 10.0  # a longer wait may be one in milliseconds [s]
# On other controls G60 is a positioning from one side.
_EXACT_STOPS = ("G60", "G61")


class Waits:
    """The waits of a program, and which of them may be meant in milliseconds.

    Args:
        notes: Notes on what is assumed.
    """

    def __init__(self, notes: ReadingNotes) -> None:
        self._notes = notes
        self._long_waits: list[str] = []

    def wait(self, line: int, values: dict[str, float]) -> Dwell:
        """Return the wait of a line, and take its words out of the line's.

        Raises:
            ValueError: If it is not read.
        """
        # A printer's S is in seconds; of others it may be turns of the spindle.
        letters = "PSXF" if "E" in self._notes.left_out else "PXF"
        words = [letter for letter in letters if letter in values]
        if "S" in values and "S" not in letters:
            raise ValueError(
                "expected a wait G4 P in seconds, got S, revolutions or seconds: write it with P"
            )
        if len(words) > 1 and words[0] == "P":
            words = words[:1]
        letter = words[0] if words else ""
        if not words:
            raise ValueError("expected a wait G4 P in seconds, got none: give P")
        duration = require_within(letter, values.pop(letter), 0.0, _MAX_DWELL, "s")
        if letter != "P":
            self._notes.assume(f"G4 {letter} is a wait in seconds")
        if duration > _DOUBTFUL_DWELL or (
            duration > 1.0 and letter == "P" and "E" in self._notes.left_out
        ):
            self._long_waits.append(
                f"line {line}: G4 {letter}{duration:g} waits {duration:g} s; where it is from a control"
                f" that takes milliseconds, write G4 {letter}{duration / 1000.0:g}"
            )
        if not frozenset("XYZ").isdisjoint(values):
            raise ValueError(
                "expected G4 without coordinates, got some: write them in another line"
            )
        return Dwell(duration)

    def note_exact_stops(self) -> None:
        """Note the words of exact stops that were left out, and what makes them."""
        words = [word for word in _EXACT_STOPS if word in self._notes.left_out]
        if words:
            self._notes.assume(
                f"{' and '.join(words)}, exact stops on many controls: the tool rests where its"
                " direction changes by more than corner_deg; with corner_deg = 0 wherever it changes"
            )

    def note_long(self) -> None:
        """Note the first wait that may be meant in milliseconds, and how many others there are."""
        if self._long_waits:
            others = len(self._long_waits) - 1
            self._notes.assume(self._long_waits[0] + (f"; so do {others} others" if others else ""))
