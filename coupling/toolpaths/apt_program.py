"""Points, tool axes and feeds of APT cutter location data."""

from __future__ import annotations

import math
from collections import Counter
from dataclasses import dataclass, field
from pathlib import Path

import numpy as np
from scipy.spatial.transform import Rotation

from coupling.errors import CaseError
from coupling.files.formats import other_format
from coupling.path.frame import Frame
from coupling.toolpaths.apt_circle import AptCircle
from coupling.toolpaths.apt_statements import Statement, read_content, statements_of
from coupling.toolpaths.apt_words import (
    NUMBER,
    idle_word,
    numbers,
    refusal,
    tool_of,
    unit_vector,
)
from coupling.toolpaths.bounds import MAX_DISTANCE, MAX_DWELL, MAX_SPEED, require_within
from coupling.toolpaths.spindle import ProgrammedSpindle, SpindleCourse, take_spindl

_UNITS = {"MM": 0.001, "CM": 0.01, "INCH": 0.0254, "INCHES": 0.0254, "IN": 0.0254}  # [m]
_FEED_UNITS = {"MMPM": 0.001, "IPM": 0.0254}  # per minute
_PER_MINUTE = ("PERMIN", "UPM")
# Axes of a frame may be off a right angle by this [rad].
_MAX_SKEW = 0.01
_IDENTITY_POSE = (0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 1.0)
# Axes are one if they differ by less [rad].
_AXIS_TOLERANCE = 1e-9


@dataclass(frozen=True)
class AptProgram:
    """What a tool's tip does.

    Attributes:
        position: Points in the first frame of the file [m], (n, 3).
        axis: Unit vectors from the tip towards the holder at them, (n, 3).
        feed: Speeds to each [m/s], (n,); NaN for a rapid and for the first one.
        waits: Durations of a rest at each [s], (n,).
        left_out: Words that were left out, by how often.
        assumptions: Assumptions made, sentences.
        spindle: Speeds of its spindle; None where it has none.
    """

    position: np.ndarray
    axis: np.ndarray
    feed: np.ndarray
    waits: np.ndarray
    left_out: dict[str, int]
    assumptions: tuple[str, ...]
    spindle: ProgrammedSpindle | None = None


def read_program(file: Path) -> AptProgram:
    """Read an APT file of cutter locations.

    Raises:
        CaseError: With the number of the line that is not read, or if nothing moves.
    """
    content = read_content(file)
    try:
        return _program_of(content, file.name)
    except ValueError as cause:
        if other := other_format(content, ["apt"]):
            raise CaseError(f"{file}: expected APT, {other}") from cause
        raise CaseError(f"{file}: {cause}") from cause


def _program_of(content: bytes, name: str) -> AptProgram:
    reader = _Reader()
    for statement in statements_of(content):
        try:
            reader.take(statement)
        except ValueError as cause:
            raise ValueError(f"line {statement.line}: {cause}") from cause
        if statement.word == "FINI":
            break
    return reader.program(name)


@dataclass
class _Reader:
    """Modes while statements are read; lengths are in the file's unit until all are read."""

    unit: float | None = None
    implied: set[str] = field(default_factory=set)
    axis: tuple[float, ...] = (0.0, 0.0, 1.0)
    is_multax: bool | None = None
    feed: tuple[float, str] | None = None
    is_rapid: bool = False
    is_home: bool = False
    circles: list[AptCircle] = field(default_factory=list)
    place: tuple[float, ...] | None = None
    points: list[tuple[float, ...]] = field(default_factory=list)
    axes: list[tuple[float, ...]] = field(default_factory=list)
    feeds: list[tuple[float, str] | None] = field(default_factory=list)
    waits: dict[int, float] = field(default_factory=dict)
    frames: list[tuple[int, Frame]] = field(default_factory=list)
    left_out: Counter[str] = field(default_factory=Counter)
    tools: dict[str, tuple[str, ...]] = field(default_factory=dict)
    has_cut: bool = False
    change: str = ""
    spindle: SpindleCourse = field(default_factory=lambda: SpindleCourse("SPINDL/ON", "SPINDL/OFF"))

    def take(self, statement: Statement) -> None:
        """Execute a statement, or note that it is left out.

        Raises:
            ValueError: If it is neither.
        """
        word, arguments = statement.word, statement.arguments
        if tool := tool_of(statement):
            if self.has_cut and (not self.tools or self.tools.get(word, tool) != tool):
                self.change = f"{word}/{','.join(arguments)} in line {statement.line}"[:60]
            self.tools[word] = tool
        if word == "GOTO":
            self._go(*self._places(arguments))
        elif idle := idle_word(statement):
            self.left_out[idle] += 1
        elif word in self._EXECUTED:
            self._EXECUTED[word](self, statement)
        elif word != "FINI":
            raise ValueError(refusal(statement))

    def program(self, name: str) -> AptProgram:
        """Return what was read from a file of a name, in metres and in the first frame.

        Raises:
            ValueError: If nothing moves, the unit is not known, or a circle stands for points.
        """
        if len(self.points) < 2:
            raise ValueError("expected GOTO from one point to another, got none")
        scale, assumptions = self._scale()
        points, axes = np.array(self.points), np.array(self.axes)
        for circle in self.circles:
            circle.require_points(points, scale)
        ends = [*(number for number, _ in self.frames[1:]), len(points)]
        for (number, frame), end in zip(self.frames, ends, strict=False):
            there = self.frames[0][1].inverse() @ frame
            points[number:end] = there.points(points[number:end])
            axes[number:end] = there.rotate(axes[number:end])
        if any(frame.pose != _IDENTITY_POSE for _, frame in self.frames):
            assumptions.append("the part frame is MSYS, the first one where there are others")
        points *= scale
        if (farthest := np.abs(points).max()) > MAX_DISTANCE:
            raise ValueError(
                f"expected points within {MAX_DISTANCE:g} m, got {farthest:.4g} m: look at UNITS"
            )
        waits = np.zeros(len(points))
        waits[list(self.waits)] = list(self.waits.values())
        feeds = np.array([self._speed(feed, scale) for feed in self.feeds])
        return AptProgram(
            points,
            axes,
            feeds,
            waits,
            dict(self.left_out),
            tuple(assumptions),
            self.spindle.programmed(name),
        )

    def _scale(self) -> tuple[float, list[str]]:
        """Return the file's unit [m], and what was assumed of it."""
        if self.unit is not None:
            return self.unit, []
        if len(self.implied) != 1:
            raise ValueError(
                "expected UNITS/MM or UNITS/INCHES, or feeds all in MMPM or IPM, got neither: add UNITS"
            )
        (feed,) = self.implied
        name = "millimetres" if feed == "MMPM" else "inches"
        return _FEED_UNITS[feed], [f"without UNITS, lengths are in {name} as the feeds, {feed}"]

    @staticmethod
    def _speed(feed: tuple[float, str] | None, scale: float) -> float:
        if feed is None:
            return float("nan")
        speed = feed[0] * _FEED_UNITS.get(feed[1], scale) / 60.0
        return require_within("FEDRAT", speed, 1e-9, MAX_SPEED, "m/s")

    def _places(self, arguments: tuple[str, ...]) -> tuple[tuple[float, ...], tuple[float, ...]]:
        values = numbers(arguments)
        if len(values) not in (3, 6):
            raise ValueError(f"expected x, y, z and i, j, k or not, got {len(values)} numbers")
        if len(values) == 3:
            return values, self.axis
        axis = unit_vector(values[3:])
        if self.is_multax is False and math.dist(axis, self.axis) > _AXIS_TOLERANCE:
            raise ValueError("expected a tool axis that stays after MULTAX/OFF, got another one")
        return values[:3], axis

    def _go(self, place: tuple[float, ...], axis: tuple[float, ...]) -> None:
        if self.is_home:
            raise ValueError("expected no motion behind GOHOME, got one: output it as GOTO")
        if self.points and not self.is_rapid and self.feed is None:
            raise ValueError("expected RAPID or FEDRAT before, got neither")
        is_first = not self.points
        if not is_first and not self.is_rapid:
            self.spindle.cut()
            self.has_cut = True
            if self.change:
                raise ValueError(
                    f"expected one tool for all moves, got a cut behind {self.change}: give each tool"
                    " its own file"
                )
        if place != self.place or axis != self.axis or is_first:
            self.points.append(place)
            self.axes.append(axis)
            self.feeds.append(None if self.is_rapid or is_first else self.feed)
        self.place, self.axis, self.is_rapid = place, axis, False

    def _from(self, statement: Statement) -> None:
        place, axis = self._places(statement.arguments)
        if self.place is None:
            self._go(place, axis)
        elif place != self.place:
            raise ValueError("expected FROM before all motions, got another place in between")

    def _by(self, statement: Statement) -> None:
        step = numbers(statement.arguments)
        if len(step) != 3 or self.place is None:
            raise ValueError("expected GODLTA by x, y, z from a known point, got another one")
        place = tuple(a + b for a, b in zip(self.place, step, strict=True))
        self._go(place, self.axis)

    def _home(self, statement: Statement) -> None:
        self.is_home = True
        self.left_out["GOHOME"] += 1

    def _rapid(self, statement: Statement) -> None:
        if statement.arguments:
            raise ValueError(f"expected RAPID alone, got RAPID/{','.join(statement.arguments)}")
        self.is_rapid = True

    def _feed_rate(self, statement: Statement) -> None:
        values = [word for word in statement.arguments if NUMBER.fullmatch(word)]
        words = [word for word in statement.arguments if word not in values]
        unit = words[0] if words else ""
        if len(values) != 1 or len(words) > 1 or unit not in ("", *_FEED_UNITS, *_PER_MINUTE):
            raise ValueError(
                "expected FEDRAT/ and a number, per minute or in MMPM or IPM, got"
                f" {','.join(statement.arguments) or 'none'}: program feeds per minute"
            )
        if unit in _FEED_UNITS:
            self.implied.add(unit)
        self.feed = (require_within("FEDRAT", float(values[0]), 1e-6, 1e7, "per minute"), unit)

    def _units(self, statement: Statement) -> None:
        name = statement.arguments[0] if len(statement.arguments) == 1 else "none"
        unit = _UNITS.get(name)
        if unit is None or (self.unit or unit) != unit:
            raise ValueError(f"expected UNITS/MM or UNITS/INCHES once, got {name}")
        self.unit = unit

    def _multax(self, statement: Statement) -> None:
        if statement.arguments not in ((), ("ON",), ("OFF",)):
            raise ValueError(f"expected MULTAX/ON or OFF, got {','.join(statement.arguments)}")
        self.is_multax = statement.arguments != ("OFF",)

    def _tool_axis(self, statement: Statement) -> None:
        vector = numbers(statement.arguments)
        if len(vector) != 3:
            raise ValueError("expected TLAXIS/ and a vector i, j, k, got something else")
        self.axis = unit_vector(vector)

    def _system(self, statement: Statement) -> None:
        values = numbers(statement.arguments)
        if len(values) != 9:
            raise ValueError(f"expected an origin and two axes, 9 numbers, got {len(values)}")
        x, y = (np.array(unit_vector(values[k : k + 3])) for k in (3, 6))
        if abs(x @ y) > _MAX_SKEW:
            raise ValueError("expected axes x and y at a right angle, got others")
        z = np.cross(x, y) / np.linalg.norm(np.cross(x, y))
        rotation = Rotation.from_matrix(np.column_stack([x, np.cross(z, x), z]))
        if self.points and not self.frames:
            raise ValueError("expected MSYS before the first point, or not at all, got it behind")
        if self.frames and self.frames[-1][0] == len(self.points):
            self.frames.pop()
        self.frames.append((len(self.points), Frame(np.array(values[:3]), rotation)))
        self.place = None

    def _wait(self, statement: Statement) -> None:
        if len(statement.arguments) != 1 or not self.points:
            raise ValueError("expected DELAY/ and seconds behind a point, got another one")
        seconds = require_within("DELAY", numbers(statement.arguments)[0], 0.0, MAX_DWELL, "s")
        last = len(self.points) - 1
        self.waits[last] = self.waits.get(last, 0.0) + seconds

    def _turn_spindle(self, statement: Statement) -> None:
        take_spindl(self.spindle, statement.line, statement.arguments)

    def _circular(self, statement: Statement) -> None:
        if "TIMES" in statement.arguments:
            raise ValueError(
                "expected no CIRCLE with TIMES, got whole turns: output arcs as points"
            )
        values = numbers(statement.arguments)
        if len(values) < 7 or self.place is None:
            raise ValueError(
                "expected CIRCLE/ by centre, axis and radius behind a point, got another"
            )
        normal = np.array(unit_vector(values[3:6]))
        centre, first = np.array(values[:3]), len(self.points)
        self.circles.append(AptCircle(statement.line, centre, normal, values[6], first))
        self.left_out["CIRCLE"] += 1

    _EXECUTED = {
        "FROM": _from,
        "GODLTA": _by,
        "GOHOME": _home,
        "RAPID": _rapid,
        "FEDRAT": _feed_rate,
        "UNIT": _units,
        "UNITS": _units,
        "MULTAX": _multax,
        "TLAXIS": _tool_axis,
        "MSYS": _system,
        "DELAY": _wait,
        "CIRCLE": _circular,
        "SPINDL": _turn_spindle,
        "SPINDLE": _turn_spindle,
    }
