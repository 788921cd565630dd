"""The spindle of a program: its speed where it feeds, and which way it turns."""

from __future__ import annotations

from collections.abc import Collection, MutableMapping
from dataclasses import dataclass

from coupling.toolpaths.apt_words import NUMBER

# G-words with which S is something else: a wait, and limits of the spindle.
_OTHER_S = frozenset((4.0, 25.0, 26.0, 50.0, 92.0))
_CLOCKWISE, _COUNTERCLOCKWISE, _STOP = 3.0, 4.0, 5.0
_CONSTANT_CUTTING_SPEED, _CONSTANT_SPEED = 96.0, 97.0
# Words of SPINDL by what they say of the number that follows or stands alone.
_CUTTING_SPEEDS = ("SFM", "SMM", "SFPM", "SMPM", "MPM", "FPM")
_WITH_VALUE = ("RANGE", "MAXRPM", "ORIENT", "MODE", "GEAR", "DIA", "RADIUS")
_STOPS = ("OFF", "LOCK", "NEUTRL", "ORIENT")
_TELLING_NOTHING = ("RPM", "ON", "CLW", "CW", "LOW", "MEDIUM", "HIGH", "AUTO", "REV")


@dataclass(frozen=True)
class ProgrammedSpindle:
    """Speeds of a spindle in the feeds of a program.

    Attributes:
        speeds: Place and speed [1/min] of each speed that feeds have, in their order.
        problems: Sentences on what makes them no speed of a right-hand cutter.
    """

    speeds: tuple[tuple[str, float], ...]
    problems: tuple[str, ...] = ()


class SpindleCourse:
    """Speed and sense of a spindle while a program is read, in no language's words.

    Attributes:
        start: Words that start it, for messages.
        stop: Word that stops it.
    """

    def __init__(self, start: str, stop: str) -> None:
        self.start, self.stop = start, stop
        self._now: tuple[int, float] | None = None
        self._speeds: dict[float, int] = {}
        self._stopped = 0
        self._problems: list[str] = []

    def set_speed(self, line: int, speed: float) -> None:
        """Take a speed [1/min] from a line by its number."""
        self._now = (line, speed)

    def set_running(self, line: int, is_running: bool) -> None:
        """Take a start or a stop from a line by its number."""
        self._stopped = 0 if is_running else line

    def note_problem(self, line: int, sentence: str) -> None:
        """Note what makes a line's speed that of no right-hand cutter."""
        if (problem := f"line {line}: {sentence}") not in self._problems:
            self._problems.append(problem)

    def cut(self) -> None:
        """Note a move at a feed."""
        if self._now is not None:
            line, speed = self._now
            self._speeds.setdefault(speed, line)
        if self._stopped:
            self.note_problem(
                self._stopped,
                f"expected no feed behind {self.stop}, which stops the spindle, got one: write"
                f" {self.start} before it, or a rapid",
            )

    def programmed(self, name: str) -> ProgrammedSpindle | None:
        """Return the spindle of a program, by the name of its file; None where it says nothing of it."""
        if not self._speeds and not self._problems:
            return None
        speeds = ((f"line {line} of {name}", speed) for speed, line in self._speeds.items())
        return ProgrammedSpindle(
            tuple(speeds), tuple(f"{name}: {problem}" for problem in self._problems)
        )


class GcodeSpindle:
    """Words of G-code that are the spindle's: S, M3, M4, M5, G96, G97.

    Attributes:
        course: Speed and sense that they give.
    """

    def __init__(self) -> None:
        self.course = SpindleCourse("M3", "M5")
        self._is_cutting_speed = False

    def take(
        self,
        line: int,
        g: Collection[float],
        m: Collection[float],
        values: MutableMapping[str, float],
    ) -> None:
        """Take what a line says, by its number, its G- and M-words and, out of its other words, S."""
        course = self.course
        if _CONSTANT_CUTTING_SPEED in g:
            self._is_cutting_speed = True
        if _CONSTANT_SPEED in g:
            self._is_cutting_speed = False
        if "S" in values and _OTHER_S.isdisjoint(g):
            if self._is_cutting_speed:
                course.note_problem(
                    line, "expected S in 1/min, got m/min, as G96 has it: write G97"
                )
            else:
                course.set_speed(line, values.pop("S"))
        if _COUNTERCLOCKWISE in m:
            course.note_problem(
                line, "expected M3, got M4: a right-hand cutter turns clockwise; write M3"
            )
        if _STOP in m:
            course.set_running(line, False)
        elif _CLOCKWISE in m or _COUNTERCLOCKWISE in m:
            course.set_running(line, True)


def take_spindl(course: SpindleCourse, line: int, arguments: tuple[str, ...]) -> None:
    """Take a statement SPINDL of APT, by the number of its line and the words behind its slash.

    What is not known of it is a problem of the spindle, as it moves no point of the path.
    """
    numbers, words = [], []
    remaining = iter(arguments)
    for word in remaining:
        if NUMBER.fullmatch(word):
            numbers.append(float(word))
        else:
            words.append(word)
            if word in _WITH_VALUE:
                next(remaining, None)
    for word in words:
        if word in _CUTTING_SPEEDS:
            course.note_problem(
                line, f"SPINDL: expected a speed in RPM, got {word}, a cutting speed: output RPM"
            )
        elif word == "CCLW":
            course.note_problem(
                line, "SPINDL: expected CLW, got CCLW: a right-hand cutter turns clockwise"
            )
        elif word not in (*_WITH_VALUE, *_STOPS, *_TELLING_NOTHING):
            course.note_problem(
                line, f"SPINDL: expected a number, RPM, CLW, ON or OFF, got {word[:20]!r}"
            )
    if len(numbers) > 1:
        course.note_problem(line, f"SPINDL: expected one speed, got {len(numbers)}")
    elif numbers and not any(word in _CUTTING_SPEEDS for word in words):
        course.set_speed(line, numbers[0])
    course.set_running(line, not any(word in _STOPS for word in words))
