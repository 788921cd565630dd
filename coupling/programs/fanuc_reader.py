"""FANUC TP, read: .ls programs, with those that they call, their positions, frames, speeds and times."""

from __future__ import annotations

import re
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, field

from coupling.errors import ProgramError
from coupling.programs.angles import pose_of_wpr
from coupling.programs.program import HERE, Motion, Pose, ProgramFile, ProgramMove, RobotProgram
from coupling.programs.text import NUMBER, real, shortened

_RADIANS = 0.017453292519943295
_MOTION = re.compile(r"([JLCA])\s+P\[\s*(\d+)[^\]]*\]\s+(\S+)\s+(?:FINE|CNT\s?\d+)(?:\s.*)?")
_SPEED = re.compile(rf"({NUMBER})\s*(%|mm/sec|cm/min|msec|sec)")
_ELEMENT = re.compile(rf"PR\[\s*(\d+)\s*,\s*([1-6])\s*\]\s*=\s*\(?({NUMBER})\)?")
_SET = re.compile(r"(UFRAME|UTOOL)\[\s*(\d+)\s*\]\s*=\s*PR\[\s*(\d+)\s*\]")
_CHOSEN = re.compile(r"(UFRAME|UTOOL)_NUM\s*=\s*(\d+)")
_CALL = re.compile(r"CALL\s+(\w+)")
_REFUSED = re.compile(r"(IF|JMP|LBL|FOR|ENDFOR|SELECT|OFFSET|TOOL_OFFSET)\b")
_POSITION = re.compile(r"\s*P\[\s*(\d+)[^\]]*\]\s*\{(.*)", re.DOTALL)
_NUMBERED = re.compile(rf"\b([XYZWPR]|J\d)\s*=\s*({NUMBER})\s*(mm|deg)")
_PROGRAM = re.compile(r"/PROG\s+(\w+)")
# Speeds in m/s for one unit.
_PACES = {"mm/sec": 1e-3, "cm/min": 1e-2 / 60.0}
_TIMES = {"sec": 1.0, "msec": 1e-3}
# Programs that call each other.
_DEEPEST = 4


def read(files: Sequence[ProgramFile]) -> RobotProgram:
    """Return the program of .ls files: the first one, and what it calls.

    Args:
        files: Texts, the one that is started first.

    Raises:
        ProgramError: With the line, what was expected and what was got.
    """
    if not files:
        raise ProgramError("FANUC: expected a file .ls, got none")
    named = {_title(file).upper(): file for file in files}
    reader = _FanucReader(files[0].name, named)
    reader.run(files[0], 0)
    return reader.program(_title(files[0]))


def called(text: str) -> tuple[str, ...]:
    """Return the names of the programs that a text calls."""
    return tuple(name.upper() for _, line in _lines(text) for name in _CALL.findall(line))


def _title(file: ProgramFile) -> str:
    found = _PROGRAM.search(file.text)
    if found is None:
        raise ProgramError(f"{file.name}: expected /PROG and a name, got none")
    return found[1]


def _lines(text: str) -> Iterator[tuple[int, str]]:
    """Yield the instructions with the numbers of their lines in the file."""
    inside = False
    for number, line in enumerate(text.splitlines(), start=1):
        if line.startswith("/"):
            inside = line.strip() == "/MN"
            continue
        bare = re.sub(r"^\s*\d*\s*:", "", line).strip().rstrip(";").strip()
        if inside and bare and not bare.startswith(("!", "//")):
            yield number, bare


def _positions(file: ProgramFile) -> dict[int, dict[str, float]]:
    """Return the numbers of every position of a file."""
    _, _, data = file.text.partition("/POS")
    found = {}
    for part in data.split("};")[:-1]:
        given = _POSITION.fullmatch(part)
        if given is None:
            raise ProgramError(
                f"{file.name}: /POS: expected P[number]{{ .. }};, got {shortened(part.strip())!r}"
            )
        number, body = given.groups()
        where = f"{file.name}: P[{number[:9]}]"
        # Only the first group is the robot's.
        own = re.split(r"GP[2-9]\s*:", body)[0]
        text = re.sub(r"'[^']*'", "", own)
        values = {key: real(value, where) for key, value, _ in _NUMBERED.findall(text)}
        if not values:
            raise ProgramError(f"{where}: expected X, Y, Z, W, P, R or J1 to J6, got none")
        found[int(number[:9])] = values
    return found


@dataclass
class _FanucReader:
    """State of a controller while it goes through programs."""

    name: str
    files: dict[str, ProgramFile]
    registers: dict[tuple[str, str], float] = field(default_factory=dict)
    frames: dict[tuple[str, str], Pose] = field(default_factory=dict)
    chosen: dict[str, str] = field(default_factory=dict)
    used: dict[str, set[str]] = field(default_factory=lambda: {"UFRAME": set(), "UTOOL": set()})
    moves: list[ProgramMove] = field(default_factory=list)

    def run(self, file: ProgramFile, depth: int) -> None:
        """Go through a program."""
        if depth > _DEEPEST:
            raise ProgramError(
                f"{file.name}: expected at most {_DEEPEST} calls in each other, got more"
            )
        positions = _positions(file)
        for number, line in _lines(file.text):
            where = f"{file.name}: line {number}"
            if _REFUSED.match(line):
                raise ProgramError(
                    f"{where}: expected motions to positions one after the other, got"
                    f" {shortened(line)!r}"
                )
            if (call := _CALL.match(line)) is not None:
                if call[1].upper() in self.files:
                    self.run(self.files[call[1].upper()], depth + 1)
            elif re.match(r"[JLCA]\s+P", line):
                self._move(line, positions, where)
            else:
                self._set(line, where)

    def _set(self, line: str, where: str) -> None:
        if (element := _ELEMENT.fullmatch(line)) is not None:
            self.registers[element[1], element[2]] = real(element[3], where)
        elif (given := _SET.fullmatch(line)) is not None:
            word, number, register = given.groups()
            values = [self.registers.get((register, str(k))) for k in range(1, 7)]
            if None not in values:
                self.frames[word, number] = pose_of_wpr([v for v in values if v is not None])
        elif (given := _CHOSEN.fullmatch(line)) is not None:
            self.chosen[given[1]] = given[2]

    def _move(self, line: str, positions: dict[int, dict[str, float]], where: str) -> None:
        given = _MOTION.fullmatch(line)
        pace = None if given is None else _SPEED.fullmatch(given[3])
        if given is None or pace is None or given[1] in "CA":
            raise ProgramError(
                f"{where}: expected J or L to a position with a speed and FINE or CNT, got"
                f" {shortened(line)!r}"
            )
        values = positions.get(int(given[2][:9]))
        if values is None:
            raise ProgramError(
                f"{where}: expected a position in /POS, got none for P[{given[2][:9]}]"
            )
        unit, number = pace[2], real(pace[1], where)
        if number <= 0.0:
            raise ProgramError(f"{where}: expected a speed or a time > 0, got {number:g}")
        duration = _TIMES[unit] * number if unit in _TIMES else None
        speed = _PACES[unit] * number if unit in _PACES else None
        if "J1" in values:
            angles = [values[f"J{k}"] for k in range(1, 10) if f"J{k}" in values]
            self.moves.append(
                ProgramMove("joint", joints=tuple(_RADIANS * a for a in angles), duration=duration)
            )
            return
        missing = [key for key in "XYZWPR" if key not in values]
        if missing:
            raise ProgramError(
                f"{where}: expected X, Y, Z, W, P, R, got none of {', '.join(missing)}"
            )
        for word, numbers in self.used.items():
            numbers.add(self.chosen.get(word, "0"))
        pose = pose_of_wpr([values[key] for key in "XYZWPR"])
        motion: Motion = "linear" if given[1] == "L" else "joint"
        self.moves.append(ProgramMove(motion, pose, duration=duration, speed=speed))

    def program(self, title: str) -> RobotProgram:
        """Return the program that was read."""
        if not self.moves:
            raise ProgramError(f"{self.name}: expected motions, got none")
        return RobotProgram(title, tuple(self.moves), self._frame("UFRAME"), self._frame("UTOOL"))

    def _frame(self, word: str) -> Pose | None:
        """Return the frame that poses are in; None where the controller holds it."""
        numbers = self.used[word] or {self.chosen.get(word, "0")}
        if len(numbers) > 1:
            raise ProgramError(
                f"{self.name}: expected one {word} for all positions, got numbers"
                f" {', '.join(sorted(numbers))}"
            )
        (number,) = numbers
        return HERE if number == "0" else self.frames.get((word, number))
