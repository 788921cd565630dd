"""G-code as moves: what a line of words does (RS274/NGC)."""

from __future__ import annotations

import math
from collections.abc import Iterator
from pathlib import Path

import numpy as np

from coupling.errors import CaseError
from coupling.programs.reading import ReadingNotes
from coupling.toolpaths.arcs import PLANES
from coupling.toolpaths.gcode_arcs import ArcWords
from coupling.toolpaths.gcode_codes import (
    IDLE_G,
    MOTIONS,
    PARAMETERS_OF_M,
    PLANE_WORDS,
    RETURNS,
    TIP_M,
    TIP_OFF,
    TIP_ON,
    UNITS,
    WORK_OFFSETS,
    are_of_printers,
    refused_g,
    require_functions,
    require_motion_word,
    require_one_of_each,
)
from coupling.toolpaths.gcode_feed import Feed
from coupling.toolpaths.gcode_moves import Dwell, GcodeMove, GcodeProgram, Held
from coupling.toolpaths.gcode_rotary import OTHER_AXES
from coupling.toolpaths.gcode_setups import Setups
from coupling.toolpaths.gcode_tool import ToolDirection
from coupling.toolpaths.gcode_waits import Waits
from coupling.toolpaths.gcode_words import Block, read_blocks, require_letters, require_within
from coupling.toolpaths.rotary import RotaryTable
from coupling.toolpaths.spindle import GcodeSpindle

_AXES, _OFFSETS = "XYZ", "IJK"
_PLACE_LETTERS, _CENTRE_LETTERS = frozenset(_AXES), frozenset(_AXES + _OFFSETS + "R")
# G- and M-words on the tool's direction, and on the feed.
_DIRECTION_WORDS, _FEED_WORDS = TIP_ON | TIP_OFF | PLANE_WORDS | TIP_M | {69.0}, (93.0, 94.0)
# Other words that change nothing of a path of the tool's tip, and those of them with many values.
_PATHLESS_LETTERS, _REPEATED_LETTERS = frozenset("TSHDOE"), "SE"
# Words without a place, which with one are something else: a spline, a shift, or no one's.
_PLACELESS_WORDS = frozenset((5.1, 50.0, 60.0, 80.0))
# Idle words that belong to another word of their line: a printer's wait, HAAS's smoothing, and OKUMA's
# work offset.
_WORDS_OF = {"S": 4.0, "E": 187.0, "H": 15.0}
# Words behind whose line the tool stands still on every control, if only for a moment.
_PROGRAM_STOP, _EXACT_STOP = 0.0, 9.0
_MAX_DISTANCE = 100.0  # no robot goes farther [m]


def read_program(
    file: Path, rotary: RotaryTable | None = None, unit: float | None = None
) -> GcodeProgram:
    """Read a G-code file.

    Args:
        rotary: Rotary axes of its machine; None: they stand still.
        unit: Unit of its lengths until it sets one [m]; None: it has to.

    Raises:
        CaseError: With the number of the line that is not read, or if nothing moves.
    """
    notes = ReadingNotes()
    machine = _Machine(notes, rotary, unit)
    steps: list[GcodeMove | Dwell] = []
    for block in read_blocks(file, notes):
        try:
            steps += machine.steps(block)
        except ValueError as cause:
            raise CaseError(f"{file}: line {block.line}: {cause}") from cause
    machine.waits.note_long()
    machine.waits.note_exact_stops()
    try:
        machine.setups.require_single_offset()
    except ValueError as cause:
        raise CaseError(f"{file}: {cause}") from cause
    if not machine.has_moved:
        unknown = machine.unknown
        letters = ", ".join(unknown)
        never = f": {letters} never given, write G0 with it" if 0 < len(unknown) < 3 else ""
        behind = next(
            (f": {count} {key}" for key, count in notes.left_out.items() if "lines behind" in key),
            "",
        )
        raise CaseError(
            f"{file}: expected moves from one point to another, got none{never or behind}"
        )
    return GcodeProgram(
        tuple(steps),
        dict(notes.left_out),
        tuple(notes.assumptions),
        "machine" if rotary and rotary.coordinates == "machine" else "tool-tip",
        machine.tool.plane,
        machine.spindle.course.programmed(file.name),
    )


class _Machine:
    """Modes and place of the tool while a program is read; a coordinate not yet given is NaN.

    Attributes:
        has_moved: Whether it has moved from one known point to another.
        tool: Direction of the tool.
        spindle: Words of its spindle.
        waits: Its waits.
        setups: Its tools and offsets.
    """

    def __init__(self, notes: ReadingNotes, rotary: RotaryTable | None, unit: float | None) -> None:
        self._notes = notes
        self._unit = unit
        self._absolute, self._absolute_centre = True, False
        self._plane = 17.0
        self._motion: float | None = None
        self._feed = Feed(notes)
        self.spindle = GcodeSpindle()
        self._place, self._is_known = np.full(3, np.nan), False
        self.tool = ToolDirection(notes, rotary)
        self._offset = "G54"  # as a control has it at first
        self.waits = Waits(notes)
        # What took the tool away from the part, behind its moves: nothing may follow.
        self._away: str | None = None
        self._cancelled = False
        self.has_moved = False
        self._is_of_five_axes = rotary is not None
        self.setups = Setups()

    @property
    def unknown(self) -> list[str]:
        """Letters of the coordinates that are not yet given."""
        return [
            letter
            for letter, value in zip(_AXES, self._place.tolist(), strict=True)
            if value != value
        ]

    def steps(self, block: Block) -> Iterator[GcodeMove | Dwell]:
        """Yield what a line does.

        Raises:
            ValueError: If it is not read.
        """
        values = block.values
        require_functions(block.m, self._is_of_five_axes)
        if ended := self.setups.take(block, self.has_moved):
            self._lose(f"{ended} in line {block.line}")
        if not block.g and are_of_printers(block.m, values):
            values = {}  # theirs alone
        self.spindle.take(block.line, block.g, block.m, values)
        idle = self._idle_words(block, values)
        self._feed.begin_line()
        if block.g:
            self._modes(block.g, values)
            if 4.0 in block.g:
                yield self.waits.wait(block.line, values)
            for value in RETURNS.keys() & set(block.g):
                self._leave_out_return(value, values, block.line)
        if block.statements or not _DIRECTION_WORDS.isdisjoint((*block.g, *block.m)):
            lost = self.tool.modes(block, self.has_moved, self._lengths)
            if lost:
                self._lose(f"{lost} in line {block.line}")
        for word in idle:
            self._notes.leave_out(word)
        if "F" in values:
            self._feed.set(values.pop("F"), self._lengths)
        before = self.tool.held
        if values and self.tool.takes(values):
            moves = self.has_moved or (self._is_known and not _PLACE_LETTERS.isdisjoint(values))
            self.tool.take(values, self._motion, self._absolute, moves and not self._away)
        if values or self.tool.held != before:
            yield from self._moves_of(values, before)
        if _PROGRAM_STOP in block.m or _EXACT_STOP in block.g:
            yield Dwell(0.0)

    @staticmethod
    def _idle_words(block: Block, values: dict[str, float]) -> list[str]:
        """Take the words out of a line that change nothing, and those that belong to M-words."""
        idle = []
        if not _PATHLESS_LETTERS.isdisjoint(values):
            for letter in [letter for letter in values if letter in _PATHLESS_LETTERS]:
                if _WORDS_OF.get(letter) not in block.g:
                    value = values.pop(letter)
                    idle.append(letter if letter in _REPEATED_LETTERS else f"{letter}{value:g}")
        if block.m and not block.g and _PLACE_LETTERS.isdisjoint(values):
            for letter in PARAMETERS_OF_M + ("R" if 19.0 in block.m else ""):
                values.pop(letter, None)
        return idle + [f"M{value:g}" for value in block.m if value not in TIP_M]

    def _modes(self, g: tuple[float, ...], values: dict[str, float]) -> None:
        """Take the modes of a line, and the words of those that change nothing."""
        require_one_of_each(g)
        require_motion_word(g, values)
        for value in g:
            if value in MOTIONS:
                self._motion, self._cancelled = value, False
            elif value in PLANES:
                self._plane = value
            elif value in UNITS:
                self._unit = UNITS[value]
                if value == 70.0:
                    self._notes.assume(
                        "F is in inches under G70; SINUMERIK's controls keep the machine's unit of F"
                        " there, and inches are G700"
                    )
            elif value in (90.0, 91.0):
                self._absolute = value == 90.0
            elif value in (90.1, 91.1):
                self._absolute_centre = value == 90.1
            elif value in _FEED_WORDS:
                self._feed.set_mode(value)
            elif value in IDLE_G:
                self._idle(value, g, values)
            elif value == 5.0 and values.keys() == {"P"}:
                self._notes.leave_out(f"G5 P{values.pop('P'):g}")  # look-ahead of FANUC's
            elif value in (10.0, 11.0, 92.0) and not values:
                # A printer's retraction, its filament's zero, the spindle's limit.
                self._notes.leave_out(f"G{value:g}")
            elif value == 52.0 and values and not any(values.get(a, 1.0) for a in values):
                self._notes.leave_out("G52 of zeros")
                values.clear()
            elif value != 4.0 and value not in RETURNS and value not in _DIRECTION_WORDS:
                raise ValueError(refused_g(value))
        for value in _PLACELESS_WORDS.intersection(g):
            if coordinate := next(
                (letter for letter in values if letter in _AXES + _OFFSETS), None
            ):
                raise ValueError(
                    f"expected G{value:g} without coordinates, got {coordinate}: write them in another"
                    " line"
                )
        if 80.0 in g and not any(value in MOTIONS for value in g):
            self._motion, self._cancelled = None, True

    def _idle(self, value: float, g: tuple[float, ...], values: dict[str, float]) -> None:
        word = f"G{value:g}"
        for letter in IDLE_G[value]:
            if letter in values:
                word += f" {letter}{values.pop(letter):g}"
        is_offset = value in WORK_OFFSETS
        if value == 15.0 and "H" in values:
            is_offset, word = True, f"G15 H{values.pop('H'):g}"
        if is_offset:
            if word != self._offset and self.has_moved:
                raise ValueError(
                    f"expected one work offset, got {word} behind moves in {self._offset}: give each its"
                    " own file, with its part frame"
                )
            if word != self._offset:
                self._offset = word
                self._place, self._is_known = np.full(3, np.nan), False
        if value == 99.0:
            self._notes.assume("G99 is the level that cycles return to, not feed per revolution")
        self._notes.leave_out(word)

    def _leave_out_return(self, value: float, values: dict[str, float], line: int) -> None:
        """Leave out a way to a place that is not known in the part: before the moves, or behind them."""
        axes = [letter for letter in _AXES if letter in values]
        others = [letter for letter in OTHER_AXES if letter in values]
        for letter in [*axes, *others, "P"]:
            values.pop(letter, None)
        if value == 53.0 and not axes:
            self._notes.leave_out("G53")
            return
        word = f"G{value:g}"
        self._notes.leave_out(word)
        self._lose(f"{word}, {RETURNS[value]}, in line {line}")
        self.tool.forget(others if axes or others else list(OTHER_AXES))

    def _lose(self, why: str) -> None:
        """Note what took the tool to a place that is not known in the part."""
        if self.has_moved:
            self._away = self._away or why
        self._place, self._is_known = np.full(3, np.nan), False

    def _lengths(self, value: float) -> float:
        if self._unit is None:
            raise ValueError(
                "expected G20 or G21 before, got neither, the unit is not known: write G21 (mm) or G20"
                ' (inches) at the beginning, or unit = "mm" or "inch" in [tool_path]'
            )
        return value * self._unit

    def _moves_of(self, values: dict[str, float], state: Held) -> Iterator[GcodeMove]:
        is_arc = self._motion in (2.0, 3.0)
        if not (_CENTRE_LETTERS if is_arc else _PLACE_LETTERS).issuperset(values):
            require_letters(values, is_arc)
        if self._motion is None and (values or self._is_known):
            why = "G80 ended the one before" if self._cancelled else "got none"
            raise ValueError(f"expected G0, G1, G2 or G3 before the coordinates, {why}: write it")
        start = self._place
        before = start.tolist()
        target = before.copy()
        for axis, letter in enumerate(_AXES):
            if letter in values:
                way = self._lengths(values[letter])
                place = way if self._absolute else target[axis] + way
                if not -_MAX_DISTANCE <= place <= _MAX_DISTANCE:
                    if math.isnan(place):
                        raise ValueError(
                            f"expected a place to go on from, got none for {letter}: give it after G90"
                        )
                    require_within(letter, abs(place), 0.0, _MAX_DISTANCE, "m")
                target[axis] = place
        end = self._place = np.array(target)
        unknown = (
            [] if self._is_known else [a for a, at in zip(_AXES, before, strict=True) if at != at]
        )
        self._is_known = self._is_known or not self.unknown
        if is_arc and unknown:
            raise ValueError(
                f"expected a place to begin an arc at, got none for {unknown[0]}: give it before"
            )
        if unknown:
            if values and self._away and self._motion == 1.0:
                raise self._behind()
            if values and (self._motion == 1.0 or self._away):
                self._notes.leave_out(f"G{self._motion:g} from an unknown {', '.join(unknown)}")
            elif self._away:
                self._notes.leave_out("rotary axes behind the moves")
            return
        stays, turns = not is_arc and before == target, self.tool.held != state
        if stays and not turns:
            return
        is_vague = (turns or self.tool.is_tilted) and self.tool.coordinates is None
        if is_vague and self._motion == 0.0 and not self.has_moved:
            # Nothing says yet what X, Y, Z are of a tilted tool: a way on which nothing is cut.
            self._notes.leave_out("G0 with turned axes, before X, Y, Z are known in the part")
            self._lose("")
            return
        if self._away:
            raise self._behind()
        self.tool.require_meaning()
        arc = self._arc_words(values).arc(start, end) if is_arc else None
        turn = self.tool.turn(state, stays)
        if stays and (turn is None or turn.angle == 0.0):
            return
        feed = None
        if self._motion != 0.0:
            way = turn.angle if stays and turn else arc.length if arc else math.dist(before, target)
            feed = self._feed.over(way, stays)
            self.setups.require_single_tool()
        self.has_moved = True
        if feed is not None:
            self.spindle.course.cut()
        yield GcodeMove(start, end, feed, arc, turn)

    def _behind(self) -> ValueError:
        """Return the refusal of moves behind what took the tool away."""
        return ValueError(
            f"expected no moves behind {self._away}, got some: take it out, or split the program there"
        )

    def _arc_words(self, values: dict[str, float]) -> ArcWords:
        return ArcWords(
            values,
            PLANES[self._plane],
            self._motion == 2.0,
            self._absolute_centre,
            self._lengths,
            self._notes,
        )
