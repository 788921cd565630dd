"""G-code as moves: modes, units, planes, increments (RS274/NGC)."""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterator
from dataclasses import dataclass, field
from pathlib import Path

import numpy as np

from coupling.errors import CaseError
from coupling.toolpaths.arcs import PLANES, Arc
from coupling.toolpaths.gcode_words import Block, read_blocks
from coupling.toolpaths.segments import Segment, straight

_AXES, _OFFSETS = "XYZ", "IJK"
_UNITS = {20.0: 0.0254, 21.0: 0.001}  # [m]
_MOTIONS = (0.0, 1.0, 2.0, 3.0)
# Words that change nothing of a path of the tool's tip.
_IDLE_G = (40.0, 43.0, 49.0, 54.0, 61.0, 61.1, 64.0, 80.0, 94.0)
_IDLE = "TSHDO"
_ENDS = (2.0, 30.0)
# No robot goes farther [m], faster [m/s], or waits longer [s].
_FARTHEST, _FASTEST, _LONGEST = 100.0, 10.0, 3600.0


_STRAIGHT = np.zeros(3)


@dataclass(frozen=True)
class GcodeMove:
    """A move of the tool's tip.

    Attributes:
        segment: Its curve.
        feed: Its speed [m/s]; None for a rapid.
        begins, ends: Unit tangents at its ends, (3,).
        curvatures: Curvature vectors at its ends [1/m], (3,) each; zeros for a line.
    """

    segment: Segment
    feed: float | None
    begins: np.ndarray
    ends: np.ndarray
    curvatures: tuple[np.ndarray, np.ndarray] = (_STRAIGHT, _STRAIGHT)


@dataclass(frozen=True)
class Dwell:
    """A wait [s]."""

    duration: float


@dataclass(frozen=True)
class GcodeProgram:
    """Moves of a program.

    Attributes:
        steps: Its moves and waits.
        ignored: Words that were read and change nothing, by how often they stand there.
    """

    steps: tuple[GcodeMove | Dwell, ...]
    ignored: dict[str, int]


def read_program(file: Path) -> GcodeProgram:
    """Read a G-code file.

    Raises:
        CaseError: With the number of the line that is not read, or if nothing moves.
    """
    machine = _Machine()
    steps: list[GcodeMove | Dwell] = []
    for block in read_blocks(file):
        try:
            steps += machine.steps(block)
        except ValueError as cause:
            raise CaseError(f"{file}: line {block.line}: {cause}") from cause
        if any(m in _ENDS for m in block.m):
            break
    if not any(isinstance(step, GcodeMove) for step in steps):
        unknown = machine.unknown
        never = f": {', '.join(unknown)} never given" if 0 < len(unknown) < len(_AXES) else ""
        raise CaseError(f"{file}: expected moves from one point to another, got none{never}")
    return GcodeProgram(tuple(steps), dict(machine.ignored))


@dataclass
class _Machine:
    """Modes and place of the tool while a program is read; a coordinate not yet given is NaN."""

    unit: float | None = None
    absolute: bool = True
    absolute_centre: bool = False
    plane: float = 17.0
    motion: float | None = None
    feed: float | None = None
    place: np.ndarray = field(default_factory=lambda: np.full(3, np.nan))
    ignored: Counter[str] = field(default_factory=Counter)

    @property
    def unknown(self) -> list[str]:
        """Letters of the coordinates that are not yet given."""
        return [letter for letter, value in zip(_AXES, self.place, strict=True) if np.isnan(value)]

    def steps(self, block: Block) -> Iterator[GcodeMove | Dwell]:
        values = dict(block.values)
        wait = self._modes(block)
        for letter in _IDLE:
            if letter in values:
                self.ignored[f"{letter}{values.pop(letter):g}"] += 1
        for value in block.m:
            self.ignored[f"M{value:g}"] += 1
        if wait:
            yield Dwell(_bounded("P", values.pop("P", None), 0.0, _LONGEST, "s"))
        if "F" in values:
            speed = self._lengths(values.pop("F")) / 60.0
            self.feed = _bounded("F", speed, 1e-9, _FASTEST, "m/s")
        known = _AXES + (_OFFSETS + "R" if self.motion in (2.0, 3.0) else "")
        for letter in values:
            if letter not in known:
                raise ValueError(f"expected {', '.join(_AXES)} and modes, got the word {letter}")
        if values and not (wait and not set(values) & set(_AXES)):
            yield from self._moved(values)

    def _modes(self, block: Block) -> bool:
        """Take the G-words of a line; return whether it waits."""
        if len([g for g in block.g if g in _MOTIONS]) > 1:
            raise ValueError("expected one of G0, G1, G2, G3, got two")
        for g in block.g:
            if g in _MOTIONS:
                self.motion = g
            elif g in PLANES:
                self.plane = g
            elif g in _UNITS:
                self.unit = _UNITS[g]
            elif g in (90.0, 91.0):
                self.absolute = g == 90.0
            elif g in (90.1, 91.1):
                self.absolute_centre = g == 90.1
            elif g in _IDLE_G:
                self.ignored[f"G{g:g}"] += 1
            elif g != 4.0:
                raise ValueError(f"expected G0 to G4, planes, units and distances, got G{g:g}")
        return 4.0 in block.g

    def _lengths(self, value: float) -> float:
        if self.unit is None:
            raise ValueError("expected G20 or G21 before, got neither: the unit is not known")
        return value * self.unit

    def _moved(self, values: dict[str, float]) -> Iterator[GcodeMove]:
        if self.motion is None:
            raise ValueError("expected G0, G1, G2 or G3 before the first coordinates, got none")
        start, end, unknown = self.place, self.place.copy(), self.unknown
        for axis, letter in enumerate(_AXES):
            if letter in values:
                way = self._lengths(values[letter])
                end[axis] = way if self.absolute else start[axis] + way
                if np.isnan(end[axis]):
                    raise ValueError(f"expected a place to go on from, got none for {letter}")
                _bounded(letter, abs(end[axis]), 0.0, _FARTHEST, "m")
        self.place = end
        if self.motion in (2.0, 3.0):
            if unknown:
                raise ValueError(f"expected a place to begin an arc at, got none for {unknown[0]}")
            arc = self._arc(values, start, end)
            yield GcodeMove(arc.segment(), self._speed(), *arc.directions(), arc.curvatures())
        elif unknown:
            if self.motion == 1.0:
                self.ignored[f"G1 from an unknown {', '.join(unknown)}"] += 1
        elif not np.array_equal(start, end):
            along = (end - start) / np.linalg.norm(end - start)
            yield GcodeMove(straight(start, end), self._speed(), along, along)

    def _speed(self) -> float | None:
        if self.motion != 0.0 and self.feed is None:
            raise ValueError("expected a feed F before, got none")
        return None if self.motion == 0.0 else self.feed

    def _arc(self, values: dict[str, float], start: np.ndarray, end: np.ndarray) -> Arc:
        plane, clockwise = PLANES[self.plane], self.motion == 2.0
        axes = (plane.first, plane.second)
        given = [letter for letter in _OFFSETS if letter in values]
        if "R" in values:
            if given:
                raise ValueError(f"expected either R or a centre, got both R and {given[0]}")
            return Arc.of_radius(plane, start, end, self._lengths(values["R"]), clockwise)
        own = [_OFFSETS[axis] for axis in axes]
        wrong = [letter for letter in given if letter not in own]
        if not given or wrong:
            got = wrong[0] if wrong else "none"
            raise ValueError(f"expected R or a centre {own[0]}, {own[1]} in this plane, got {got}")
        if self.absolute_centre and len(given) < 2:
            raise ValueError(f"expected both {own[0]} and {own[1]} after G90.1, got {given[0]}")
        offsets = np.array([self._lengths(values.get(letter, 0.0)) for letter in own])
        centre = offsets if self.absolute_centre else start[list(axes)] + offsets
        return Arc.about(plane, start, end, centre, clockwise)


def _bounded(word: str, value: float | None, low: float, high: float, unit: str) -> float:
    if value is None or not low <= value <= high:
        got = "none" if value is None else f"{value:g} {unit}"
        raise ValueError(f"{word}: expected {low:g} to {high:g} {unit}, got {got}")
    return value
