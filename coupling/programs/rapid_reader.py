"""ABB RAPID, read: motions to targets, frames and speeds; what decides or repeats is refused."""

from __future__ import annotations

import re
from collections.abc import Iterator
from dataclasses import dataclass, field

from coupling.errors import ProgramError
from coupling.programs.program import HERE, Configuration, Motion, Pose, ProgramMove, RobotProgram
from coupling.programs.rapid_values import (
    Value,
    arguments_of,
    number_list,
    placement,
    value_of,
    with_component,
)
from coupling.programs.text import real, shortened

_RADIANS = 0.017453292519943295
_MOTIONS: dict[str, Motion] = {"MOVEABSJ": "joint", "MOVEJ": "joint", "MOVEL": "linear"}
_REFUSED = frozenset(["IF", "FOR", "WHILE", "TEST", "GOTO", "MOVEC"])
_DECLARED = re.compile(
    r"(?:LOCAL\s+|TASK\s+)*(?:CONST|PERS|VAR)\s+"
    r"(robtarget|jointtarget|tooldata|wobjdata|speeddata)\s+(\w+)\s*:=\s*(.*)",
    re.IGNORECASE | re.DOTALL,
)
_ASSIGNED = re.compile(r"(\w+)(?:\s*\.\s*(\w+))?\s*:=\s*(.*)", re.DOTALL)
_HEADING = re.compile(r"\s*((?:MODULE|ENDMODULE|(?:LOCAL\s+)?PROC|ENDPROC)\b)", re.IGNORECASE)
# Texts in quotes, comments, semicolons and what is between them.
_PIECE = re.compile(r'"[^"]*"|!.*|;|[^;"!]+|"')
_SPEED = re.compile(r"v(\d{1,4})", re.IGNORECASE)
# Axes of the robot; external ones are not looked at.
_AXES = 6


def read(text: str, name: str = "") -> RobotProgram:
    r"""Return the program of a module with one procedure.

    A speed counts where no time `\T` is given.

    Args:
        text: Text of the .mod or .prg.
        name: Name of the file, for messages.

    Raises:
        ProgramError: With the line, what was expected and what was got.

    Example:
        >>> text = "MoveL [[1,2,3],[1,0,0,0],[0,0,0,0],[9E9,9E9,9E9,9E9,9E9,9E9]],v100\\T:=0.5,z0,tool0;"
        >>> move = read(text).moves[0]
        >>> move.motion, [round(x, 9) for x in move.pose[:3]], move.duration
        ('linear', [0.001, 0.002, 0.003], 0.5)
    """
    reader = _RapidReader(name or "RAPID")
    for number, statement in _statements(text, reader.name):
        reader.take(statement, f"{reader.name}: line {number}")
    return reader.program()


def _statements(text: str, name: str) -> Iterator[tuple[int, str]]:
    """Yield statements with the lines they begin in, without comments."""
    begun = 0
    words: list[str] = []
    in_header = False  # what a controller writes between two lines %%% above the module
    for number, line in enumerate(text.splitlines(), start=1):
        if line.strip() == "%%%":
            in_header = not in_header
            continue
        if in_header:
            continue
        if not words and (heading := _HEADING.match(line)) is not None:
            yield number, line[heading.start(1) :].split("!")[0].strip()
            continue
        for piece in _PIECE.findall(line):
            if piece.startswith("!"):
                break
            if piece == ";":
                yield begun or number, "".join(words).strip()
                begun, words = 0, []
            elif piece.strip() or words:
                begun = begun or number
                words.append(piece)
        if words:
            words.append(" ")
    if words:
        found = shortened("".join(words[:8]).strip())
        raise ProgramError(f"{name}: line {begun}: expected a semicolon behind {found!r}, got none")


@dataclass
class _RapidReader:
    """State of a controller while it goes through a module."""

    name: str
    title: str = ""
    data: dict[str, tuple[str, Value]] = field(default_factory=dict)
    frames: list[tuple[str, str]] = field(default_factory=list)
    moves: list[ProgramMove] = field(default_factory=list)

    def take(self, statement: str, where: str) -> None:
        """Go on by one statement."""
        word = re.split(r"[\s\\(]", statement, maxsplit=1)[0].upper()
        heading = re.match(r"(?:LOCAL\s+)?PROC\s+(\w+)", statement, re.IGNORECASE)
        if word in _REFUSED:
            raise ProgramError(
                f"{where}: expected motions to targets one after the other, MoveL, MoveJ, MoveAbsJ, got"
                f" {word}"
            )
        if heading:
            if self.moves:
                raise ProgramError(f"{where}: expected motions in one procedure, got another one")
            self.title = heading[1]
        elif (declared := _DECLARED.fullmatch(statement)) is not None:
            kind, name, value = declared.groups()
            self.data[name.upper()] = (kind.lower(), value_of(value, where))
        elif word in _MOTIONS:
            self._move(word, statement[len(word) :], where)
        elif (given := _ASSIGNED.fullmatch(statement)) is not None and given[
            1
        ].upper() in self.data:
            self._assign(given[1], given[2], given[3], where)
        elif word.startswith("MOVE"):
            raise ProgramError(f"{where}: expected MoveL, MoveJ or MoveAbsJ, got {shortened(word)}")

    def _assign(self, name: str, component: str | None, text: str, where: str) -> None:
        """Give data, or a component of them, another value."""
        kind, value = self.data[name.upper()]
        used = {one.upper() for pair in self.frames for one in pair}
        if name.upper() in used and any(move.pose for move in self.moves):
            raise ProgramError(f"{where}: expected one {name} for all targets, got another one")
        new = value_of(text, where)
        if component is not None:
            new = with_component(kind, value, component, new, where)
        self.data[name.upper()] = (kind, new)

    def _known(self, text: str, kind: str, where: str) -> Value:
        """Return the value of a name, or one in brackets."""
        if text.startswith("["):
            return value_of(text, where)
        found = self.data.get(text.upper())
        if found is None or found[0] != kind:
            raise ProgramError(f"{where}: expected a {kind} with a value, got {shortened(text)!r}")
        return found[1]

    def _move(self, word: str, rest: str, where: str) -> None:
        # A comma may stand before an option as well.
        whole = re.sub(r",\s*\\", r"\\", rest)
        arguments = [part.split("\\") for part in arguments_of(whole)]
        if len(arguments) != 4 or not arguments[0][0].strip():
            raise ProgramError(
                f"{where}: expected a target, a speed, a zone and a tool, got {len(arguments)} arguments"
            )
        target, speed, _, tool = arguments
        options = {
            k.strip().upper(): v.strip() for k, _, v in (o.partition(":=") for o in speed[1:])
        }
        duration = real(options["T"], where) if "T" in options else None
        if duration is not None and duration <= 0.0:
            raise ProgramError(f"{where}: expected a time \\T > 0, got {duration:g}")
        self.frames.append((tool[0].strip(), _work_object(tool[1:])))
        if word == "MOVEABSJ":
            joints = self._joints(target[0].strip(), where)
            self.moves.append(ProgramMove("joint", joints=joints, duration=duration))
            return
        pace = None if duration is not None else self._speed(speed[0].strip(), options, where)
        pose, posture = self._pose(target[0].strip(), where)
        self.moves.append(ProgramMove(_MOTIONS[word], pose, None, duration, pace, posture))

    def _joints(self, text: str, where: str) -> tuple[float, ...]:
        value = self._known(text, "jointtarget", where)
        if not isinstance(value, list) or len(value) != 2:
            raise ProgramError(
                f"{where}: expected robot and external axes, got {shortened(text)!r}"
            )
        return tuple(_RADIANS * a for a in number_list(value[0], _AXES, "axes", where))

    def _pose(self, text: str, where: str) -> tuple[Pose, Configuration | None]:
        value = self._known(text, "robtarget", where)
        if not isinstance(value, list) or len(value) != 4:
            raise ProgramError(
                f"{where}: expected position, rotation, configuration and external axes, got"
                f" {shortened(text)!r}"
            )
        number_list(value[2], 4, "configuration", where)
        return placement(value[:2], where), None

    def _speed(self, text: str, options: dict[str, str], where: str) -> float:
        if "V" in options:
            return 1e-3 * real(options["V"], where)
        simple = _SPEED.fullmatch(text)
        if simple and text.upper() not in self.data:
            return 1e-3 * float(simple[1])
        value = self._known(text, "speeddata", where)
        return 1e-3 * number_list(value, 4, "speed", where)[0]

    def _frame(self, name: str, kind: str, at: int) -> Pose | None:
        """Return the frame of a tool or a work object; None where the controller holds it."""
        found = self.data.get(name.upper())
        if found is None:
            return None
        where = f"{self.name}: {name}"
        value = found[1]
        if found[0] != kind or not isinstance(value, list) or len(value) <= at:
            raise ProgramError(f"{where}: expected {kind}, got {found[0]} {shortened(str(value))}")
        if kind == "wobjdata":
            inner = value[4] if len(value) > 4 else None
            if inner is not None and placement(inner, where) != HERE:
                raise ProgramError(f"{where}: expected an object frame of zeros, got another one")
            if value[0] != "FALSE":
                raise ProgramError(
                    f"{where}: expected a work object that stands, got one that is held"
                )
        return placement(value[at], where)

    def program(self) -> RobotProgram:
        """Return the program that was read."""
        if not self.moves:
            raise ProgramError(f"{self.name}: expected motions, got none")
        used = {
            frames for frames, move in zip(self.frames, self.moves, strict=True) if move.pose
        } or {self.frames[0]}
        if len(used) > 1:
            raise ProgramError(
                f"{self.name}: expected one tool and work object for all targets, got {len(used)} pairs"
            )
        ((tool, work_object),) = used
        return RobotProgram(
            self.title or self.name,
            tuple(self.moves),
            self._frame(work_object, "wobjdata", 3),
            self._frame(tool, "tooldata", 1),
        )


def _work_object(options: list[str]) -> str:
    for option in options:
        name, _, value = option.partition(":=")
        if name.strip().upper() == "WOBJ":
            return value.strip()
    return "wobj0"
