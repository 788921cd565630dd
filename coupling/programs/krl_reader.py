"""KUKA KRL, read: motions to points, frames, speeds and times; what decides or repeats is refused."""

from __future__ import annotations

import re
from collections.abc import Iterator
from dataclasses import dataclass, field

from coupling.errors import ProgramError
from coupling.programs.angles import pose_of_abc
from coupling.programs.program import Motion, Pose, ProgramMove, RobotProgram
from coupling.programs.text import real, shortened

_RADIANS = 0.017453292519943295
_MOTIONS: dict[str, Motion] = {
    "PTP": "joint",
    "SPTP": "joint",
    "LIN": "linear",
    "SLIN": "linear",
    "SPL": "spline",
}
_MOVE = re.compile(
    r"(PTP|SPTP|LIN|SLIN|SPL)\s+(\{[^{}]*\}|[$A-Z_][\w$]*(?:\s*\[\s*\d+\s*\])?)(.*)", re.IGNORECASE
)
# As the system variable, in a clause of a spline's motion, or by the pendant's routine.
_SPEED = re.compile(
    r"(?:\$VEL\.CP\s*=|\$VEL\s*=\s*SVEL_CP\s*\(|BAS\s*\(\s*#(?:VEL_CP|CP_PARAMS)\s*,)"
    r"\s*([^\s,;)]+)",
    re.IGNORECASE,
)
_BLOCK = re.compile(r"TIME_BLOCK\s+(START|PART\s*=|END\s*=)\s*(.*)", re.IGNORECASE)
# Words that choose or repeat motions, and motions that are not read.
_REFUSED_WORDS = """
IF ELSE FOR WHILE LOOP REPEAT SWITCH CASE GOTO CIRC SCIRC PTP_REL LIN_REL SPTP_REL SLIN_REL
CIRC_REL SCIRC_REL SPL_REL
"""
_REFUSED = frozenset(_REFUSED_WORDS.split())
_NUMBERS = {"$TOOL": "TOOL_NO", "$BASE": "BASE_NO"}
# The numbers of both that the pendant keeps with a point.
_KEPT = re.compile(r"(?:DECL\s+)?(?:GLOBAL\s+)?FDAT\s+(\w+)\s*=\s*(\{.*\})", re.IGNORECASE)
_ACTIVE = re.compile(r"FDAT_ACT\s*=\s*(.+)", re.IGNORECASE)
# What makes them count: a routine of the pendant's motions, or a clause of a spline's.
_APPLIED = re.compile(r"BAS\s*\(\s*#(?:FRAMES|CP_PARAMS|PTP_PARAMS)\b", re.IGNORECASE)
_CLAUSE = re.compile(r"(\$TOOL|\$BASE)\s*=\s*(\w+\s*\([^()]*\)|[^,]+)", re.IGNORECASE)
_FRAME_KEYS, _AXIS_KEYS = "XYZABC", tuple(f"A{i}" for i in range(1, 7))
ASSIGNED = re.compile(
    r"(?:DECL\s+)?(?:GLOBAL\s+)?(?:(?:FRAME|POS|E6POS|AXIS|E6AXIS)\s+)?"
    r"([$A-Z_][\w$]*(?:\s*\[\s*\d+\s*\])?)\s*=\s*(\{[^{}]*\})",
    re.IGNORECASE,
)


def read(source: str, data: str = "", name: str = "") -> RobotProgram:
    """Return the program of a .src and, where its points stand in one, its .dat.

    Components of a point that are left out stay what they were, as on the controller; status, turn and
    external axes are not looked at.  PTP to a point without a value, as HOME, may stand before and
    behind the path.

    Args:
        source: Text of the .src.
        data: Text of the .dat.
        name: Name of the file, for messages.

    Raises:
        ProgramError: With the line, what was expected and what was got.

    Example:
        >>> lines = ["DEF WAY()", "$VEL.CP=0.5", "LIN {X 1,Y 2,Z 3,A 0,B 0,C 0}", "END"]
        >>> move = read(chr(10).join(lines)).moves[0]
        >>> move.motion, [round(x, 9) for x in move.pose[:3]], move.speed
        ('linear', [0.001, 0.002, 0.003], 0.5)
    """
    reader = _KrlReader(name or "KRL", points(data, f"{name or 'KRL'}: points"))
    for number, line in statements(data):
        reader.frames.take(line, False, f"{reader.name}: line {number}")
    for number, line in statements(source):
        reader.take(line, f"{reader.name}: line {number}")
    return reader.program()


@dataclass
class _KrlFrames:
    """Tool and base while a program is read.

    Attributes:
        poses: Each by `$TOOL` and `$BASE`; None where the controller holds it.
        kept: Numbers that belong to points, by name.
    """

    poses: dict[str, Pose | None] = field(default_factory=dict)
    kept: dict[str, str] = field(default_factory=dict)
    _sources: dict[str, str] = field(default_factory=dict)
    _active: str = ""

    def take(self, line: str, begun: bool, where: str) -> None:
        """Go on by one statement.

        Args:
            line: The statement.
            begun: Whether there are poses already.
            where: Its place, for the message.

        Raises:
            ProgramError: If the poses from here on would be in another frame than those before.
        """
        if (found := _KEPT.fullmatch(line)) is not None:
            self.kept[found[1].upper()] = found[2]
        elif (found := _ACTIVE.fullmatch(line)) is not None:
            self._active = found[1]
        elif _APPLIED.match(line) is not None and self._active:
            for word in _NUMBERS:
                self.set(word, self._active, None, begun, where)
        else:
            for word, source in _CLAUSE.findall(line.partition("WITH")[2]):
                self.set(word.upper(), source, None, begun, where)

    def set(self, word: str, source: str, pose: Pose | None, begun: bool, where: str) -> None:
        """Set one of the two; `source` is what stands behind the equals sign.  Raises as `take`."""
        number = self._number(word, source)
        if begun and number != self._sources.get(word):
            raise ProgramError(f"{where}: expected one {word} for all poses, got another one")
        self.poses[word], self._sources[word] = pose, number

    def _number(self, word: str, source: str) -> str:
        """Return the number that a source stands for, or what it says."""
        text = re.sub(r"\s", "", source).upper()
        name = re.search(r"\(?(\w+)(?:\.\w+)?\)?$", text)
        known = self.kept.get(name[1], source) if name else source
        found = re.search(rf"\b{_NUMBERS[word]}\s+(\d+)", known, re.IGNORECASE)
        return found[1] if found else re.sub(r"^\w+[\[(](\d+)[\])]$", r"\1", text)


@dataclass
class _KrlReader:
    """State of a controller while it goes through a program."""

    name: str
    points: dict[str, dict[str, float]]
    title: str = ""
    frames: _KrlFrames = field(default_factory=_KrlFrames)
    moves: list[ProgramMove] = field(default_factory=list)
    last: dict[str, float] = field(default_factory=dict)
    speed: float | None = None
    spline: bool = False
    left: str = ""
    begun: bool = False
    block: list[tuple[int, float]] | None = None

    def take(self, line: str, where: str) -> None:
        """Go on by one statement."""
        word = re.split(r"[\s(\[=]", line, maxsplit=1)[0].upper()
        if word in _REFUSED:
            raise ProgramError(
                f"{where}: expected motions to points one after the other, PTP, LIN, SPL and their like,"
                f" got {word}"
            )
        if word == "DEF" and not self.title:
            self.title = line[3:].split("(")[0].strip()
        if word == "DEF" and self.moves:
            raise ProgramError(f"{where}: expected one program in the file, got another one")
        self.frames.take(line, self.begun, where)
        if word in ("$BASE", "$TOOL"):
            self._frame(word, line, where)
        elif word in _MOTIONS:
            self._move(line, where)
        elif word == "TIME_BLOCK":
            self._time(line, where)
        elif word in ("SPLINE", "PTP_SPLINE", "ENDSPLINE"):
            if self.block is not None:
                raise ProgramError(f"{where}: expected TIME_BLOCK END, got {word}")
            self.spline = word != "ENDSPLINE"
        elif (speed := _SPEED.match(line)) is not None:
            self.speed = real(speed[1], where)
        elif (given := ASSIGNED.fullmatch(line)) is not None:
            self.points[key_of(given[1])] = fields_of(given[2], where)

    def _frame(self, word: str, line: str, where: str) -> None:
        given, source = ASSIGNED.fullmatch(line), line.partition("=")[2]
        # Without a value it is a number of a frame that the controller holds.
        pose = None if given is None else self._pose(fields_of(given[2], where), where)
        self.frames.set(word, source, pose, self.begun, where)

    def _pose(self, fields: dict[str, float], where: str) -> Pose:
        missing = [key for key in _FRAME_KEYS if key not in fields]
        if missing:
            raise ProgramError(
                f"{where}: expected X, Y, Z, A, B, C, got none of {', '.join(missing)}"
            )
        return pose_of_abc([fields[key] for key in _FRAME_KEYS])

    def _move(self, line: str, where: str) -> None:
        given = _MOVE.fullmatch(line)
        if given is None:
            raise ProgramError(f"{where}: expected a motion to a point, got {shortened(line)!r}")
        word, target, rest = given.groups()
        if target.startswith("{"):
            fields = fields_of(target, where)
        elif (key := key_of(target)) in self.points:
            fields = self.points[key]
        elif self._leaves(word, target):
            return
        else:
            raise ProgramError(
                f"{where}: expected a point that has a value, got {shortened(target)!r}: give the .dat"
            )
        motion, own = _MOTIONS[word.upper()], _SPEED.search(rest)
        if self.spline and word.upper() == "SPTP":
            motion = "spline"
        speed = self.speed if own is None else real(own[1], where)
        if any(key in fields for key in _AXIS_KEYS):
            angles = tuple(_RADIANS * fields[key] for key in _AXIS_KEYS if key in fields)
            self.moves.append(ProgramMove(motion, joints=angles, speed=None))
            self.last = {}
            return
        if self.left:
            raise ProgramError(
                f"{where}: expected no motion behind PTP {self.left}, which has no value, got one"
            )
        self.last = {**self.last, **fields}
        self.moves.append(ProgramMove(motion, self._pose(self.last, where), speed=speed))
        self.begun = True

    def _leaves(self, word: str, target: str) -> bool:
        """Tell whether a motion only leads to or from the path, to where the controller knows."""
        if word.upper() not in ("PTP", "SPTP") or self.block is not None:
            return False
        if self.begun:
            self.left = shortened(target)
        return True

    def _time(self, line: str, where: str) -> None:
        given = _BLOCK.fullmatch(line)
        if given is None:
            raise ProgramError(f"{where}: expected START, PART or END, got {shortened(line)!r}")
        kind = given[1].split("=")[0].strip().upper()
        if (kind == "START") != (self.block is None):
            raise ProgramError(f"{where}: expected START, then PART and END, got {kind}")
        if kind == "START":
            self.block = [(len(self.moves), 0.0)]
            return
        assert self.block is not None
        value = real(given[2], where)
        if value <= 0.0:
            raise ProgramError(f"{where}: expected a time > 0, got {value:g}")
        if kind == "PART":
            if len(self.moves) != self.block[-1][0] + 1:
                raise ProgramError(
                    f"{where}: expected a TIME_BLOCK PART behind every segment, got"
                    f" {len(self.moves) - self.block[-1][0]} segments since the last one"
                )
            self.block.append((len(self.moves), value))
            return
        self._end(value, where)

    def _end(self, total: float, where: str) -> None:
        """Give the block's segments their shares of its time."""
        assert self.block is not None
        shares = self.block[1:]
        if not shares or shares[-1][0] != len(self.moves):
            raise ProgramError(f"{where}: expected segments, each with its PART, got others")
        whole = sum(share for _, share in shares)
        for count, share in shares:
            move = self.moves[count - 1]
            self.moves[count - 1] = ProgramMove(
                move.motion, move.pose, move.joints, duration=total * share / whole
            )
        self.block = None

    def program(self) -> RobotProgram:
        """Return the program that was read."""
        if self.block is not None:
            raise ProgramError(f"{self.name}: expected TIME_BLOCK END, got the end of the file")
        if not self.moves:
            raise ProgramError(f"{self.name}: expected motions, got none")
        base, tool = self.frames.poses.get("$BASE"), self.frames.poses.get("$TOOL")
        return RobotProgram(self.title or self.name, tuple(self.moves), base, tool)


def statements(text: str) -> Iterator[tuple[int, str]]:
    """Yield statements with the numbers of their lines, without comments and file headers."""
    for number, line in enumerate(text.splitlines(), start=1):
        bare = line.split(";", 1)[0].strip()
        if bare and not bare.startswith("&"):
            yield number, bare


def points(data: str, where: str) -> dict[str, dict[str, float]]:
    """Return the fields of the points that a .dat gives values."""
    found = {}
    for number, line in statements(data):
        given = ASSIGNED.fullmatch(line)
        if given:
            found[key_of(given[1])] = fields_of(given[2], f"{where}: line {number}")
    return found


def key_of(name: str) -> str:
    """Return the key of points of one name: KRL's letters have no case."""
    return re.sub(r"\s", "", name).upper()


def fields_of(aggregate: str, where: str) -> dict[str, float]:
    """Return the numbers of {X 1, Y 2, ..}, with or without the name of its type before a colon."""
    inner = aggregate.strip("{} \t")
    fields = {}
    for part in inner.split(":", 1)[-1].split(","):
        words = part.split()
        if len(words) != 2:
            raise ProgramError(
                f"{where}: expected a letter and a number, got {shortened(part.strip())!r}"
            )
        if re.fullmatch(r"[XYZABC]|A[1-6]", words[0], re.IGNORECASE):
            fields[words[0].upper()] = real(words[1], where)
    return fields
