"""The spindle of a program: its speed where it feeds, S, and which way it turns, M3 or M4."""

from __future__ import annotations

from collections.abc import Collection, MutableMapping
from dataclasses import dataclass

# Words with which S is something else: a wait, and limits of the spindle.
_OTHER_S = frozenset((4.0, 25.0, 26.0, 50.0, 92.0))
_CLOCKWISE, _COUNTERCLOCKWISE, _STOP = 3.0, 4.0, 5.0
_CONSTANT_CUTTING_SPEED, _CONSTANT_SPEED = 96.0, 97.0


@dataclass(frozen=True)
class ProgrammedSpindle:
    """Speeds of a spindle in the feeds of a program.

    Attributes:
        speeds: Place and speed [1/min] of each S that feeds have, in their order.
        problems: Sentences on what makes them no speed of a right-hand cutter.
    """

    speeds: tuple[tuple[str, float], ...]
    problems: tuple[str, ...] = ()


class SpindleWords:
    """What a reader of G-code notes of the spindle."""

    def __init__(self) -> None:
        self._now: tuple[int, float] | None = None
        self._speeds: dict[float, int] = {}
        self._is_cutting_speed, self._stopped = False, 0
        self._problems: list[str] = []

    def take(
        self,
        line: int,
        g: Collection[float],
        m: Collection[float],
        values: MutableMapping[str, float],
    ) -> None:
        """Take what a line says, by its number, its G- and M-words and, out of its other words, S."""
        if _CONSTANT_CUTTING_SPEED in g:
            self._is_cutting_speed = True
        if _CONSTANT_SPEED in g:
            self._is_cutting_speed = False
        if "S" in values and _OTHER_S.isdisjoint(g):
            if self._is_cutting_speed:
                self._problem(
                    f"line {line}: expected S in 1/min, got m/min, as G96 has it: write G97"
                )
            else:
                self._now = (line, values.pop("S"))
        if _COUNTERCLOCKWISE in m:
            self._problem(
                f"line {line}: expected M3, got M4: a right-hand cutter turns clockwise; write M3"
            )
        if _STOP in m:
            self._stopped = line
        elif _CLOCKWISE in m or _COUNTERCLOCKWISE in m:
            self._stopped = 0

    def cut(self) -> None:
        """Note a move at a feed."""
        if self._now is not None:
            line, speed = self._now
            self._speeds.setdefault(speed, line)
        if self._stopped:
            self._problem(
                f"line {self._stopped}: expected no feed behind M5, which stops the spindle, got one:"
                " write M3 before it, or G0"
            )

    def programmed(self, name: str) -> ProgrammedSpindle | None:
        """Return the spindle of a program, by the name of its file; None where it says nothing of it."""
        if not self._speeds and not self._problems:
            return None
        speeds = ((f"line {line} of {name}", speed) for speed, line in self._speeds.items())
        return ProgrammedSpindle(
            tuple(speeds), tuple(f"{name}: {problem}" for problem in self._problems)
        )

    def _problem(self, sentence: str) -> None:
        if sentence not in self._problems:
            self._problems.append(sentence)
