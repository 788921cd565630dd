"""The text of a .ls file of FANUC: instructions, labels and blocks, and the data of positions."""

from __future__ import annotations

import re
from collections.abc import Iterator
from dataclasses import dataclass
from functools import cached_property

from coupling.errors import ProgramError
from coupling.programs.program import ProgramFile
from coupling.programs.text import shorten

_PROGRAM = re.compile(r"^\s*/PROG\s+([^\s:;]+)", re.MULTILINE | re.IGNORECASE)
_GROUPS = re.compile(r"^\s*DEFAULT_GROUP\s*=\s*([^\s,;]+)", re.MULTILINE)
_SECTION = re.compile(r"/[A-Z]+\b", re.IGNORECASE)
# The number of a line; a line with none but a colon continues the one before.
_NUMBERED = re.compile(r"\s*(\d*)\s*:")
# A controller's lines are shorter by far.
_MAX_LINE_LENGTH = 2000
_COMMENTS = ("!", "//", "--eg")
# What a user calls a register, a position or a label, behind its number.
_NAME = re.compile(r":[^\[\]]*(?=\])")
_FIRST_GROUP = re.compile(r"\bGP1\s*:\s*", re.IGNORECASE)
_POSITION = re.compile(
    r"\s*P\[\s*(\d{1,9})\s*(?::\s*\"[^\"\n]*\"\s*|:[^\]\n]*)?\]\s*\{([^{}]*)\}\s*;?"
)
_ABORT = re.compile(r"\bABORT\b", re.IGNORECASE)
_LABEL = re.compile(r"LBL\[\s*(\d{1,9})\s*\]", re.IGNORECASE)
_THEN = re.compile(r"IF\b.*\bTHEN", re.IGNORECASE)


@dataclass(frozen=True)
class Instruction:
    """An instruction of a program.

    Attributes:
        line: Number of its line in the file.
        text: Its words, without numbers of lines and names in brackets.
    """

    line: int
    text: str


@dataclass(frozen=True)
class TpText:
    """A .ls file, cut up but not understood.

    Attributes:
        file: Name of the file.
        title: Name of the program.
        instructions: Its instructions; comments and blank ones are not among them.
        positions: Text of the data of each position, by its number.
        moves_robot: Whether its motions are of the first group, the robot.
    """

    file: str
    title: str
    instructions: tuple[Instruction, ...]
    positions: dict[int, str]
    moves_robot: bool

    @classmethod
    def of(cls, file: ProgramFile) -> TpText:
        """Cut up a file.

        Raises:
            ProgramError: If it has no name, or its positions are none.
        """
        text = file.text.replace("\r\n", "\n").replace("\r", "\n")
        title = _PROGRAM.search(text)
        if title is None:
            raise ProgramError(f"{file.name}: expected /PROG and a name, got none")
        sections = _sections(text)
        groups = _GROUPS.search(text)
        instructions = tuple(_instructions(sections["/MN"]))
        for instruction in instructions:
            if len(instruction.text) > _MAX_LINE_LENGTH:
                raise ProgramError(
                    f"{file.name}: line {instruction.line}: expected at most {_MAX_LINE_LENGTH}"
                    f" characters in an instruction, got {len(instruction.text)}"
                )
        return cls(
            file=file.name,
            title=title[1],
            instructions=instructions,
            positions=_positions(file.name, "\n".join(line for _, line in sections["/POS"])),
            moves_robot=groups is None or groups[1] == "1",
        )

    def where(self, index: int) -> str:
        """Return the place of an instruction, for messages."""
        return f"{self.file}: line {self.instructions[index].line}"

    @cached_property
    def holds_abort(self) -> bool:
        """Whether an instruction may end all programs."""
        return any(_ABORT.search(instruction.text) for instruction in self.instructions)

    @cached_property
    def labels(self) -> dict[int, int]:
        """Index of the instruction that each label stands at."""
        places: dict[int, int] = {}
        for index, instruction in enumerate(self.instructions):
            if (label := _LABEL.fullmatch(instruction.text)) is not None:
                if int(label[1]) in places:
                    raise ProgramError(
                        f"{self.where(index)}: expected each label once, got {label[0]} again"
                    )
                places[int(label[1])] = index
        return places

    @cached_property
    def partners(self) -> dict[int, int]:
        """Index of what closes a block for each that opens or divides one, and of FOR for ENDFOR."""
        partners: dict[int, int] = {}
        opened: list[int] = []
        for index, instruction in enumerate(self.instructions):
            word = instruction.text.upper()
            if word.startswith("FOR ") or _THEN.fullmatch(word):
                opened.append(index)
            elif word in ("ENDFOR", "ELSE", "ENDIF"):
                kind = "FOR" if word == "ENDFOR" else "IF"
                start = opened.pop() if opened else -1
                while start >= 0 and self._opens(start) != kind:
                    start = opened.pop() if opened else -1
                if start < 0:
                    raise ProgramError(f"{self.where(index)}: expected {kind} before {word}")
                partners[start] = index
                if word == "ELSE":
                    opened.append(index)
                elif word == "ENDFOR":
                    partners[index] = start
        return partners

    def _opens(self, index: int) -> str:
        return "FOR" if self.instructions[index].text.upper().startswith("FOR ") else "IF"


def _sections(text: str) -> dict[str, list[tuple[int, str]]]:
    """Return the numbered lines of instructions and of positions."""
    sections: dict[str, list[tuple[int, str]]] = {"/MN": [], "/POS": []}
    name = ""
    for number, line in enumerate(text.split("\n"), start=1):
        if (section := _SECTION.match(line)) is not None:
            name = section[0].upper()
        elif name in sections:
            sections[name].append((number, line))
    return sections


def _instructions(lines: list[tuple[int, str]]) -> Iterator[Instruction]:
    """Yield the instructions: each ends with a semicolon, or where a numbered line begins."""
    start, words, remarked = 0, "", False
    for number, line in lines:
        head = _NUMBERED.match(line)
        continues = head is not None and not head[1]
        text = line[head.end() :] if head is not None else line
        if remarked and continues:
            remarked = ";" not in text
            continue
        remarked = False
        if words and not continues and head is not None:
            yield Instruction(start, _bare(words))
            words = ""
        *whole, last = text.split(";")
        for piece in [*whole, last]:
            if not words and piece.lstrip().startswith(_COMMENTS):
                # An instruction that was taken out may go on in lines without a number.
                remarked = piece.lstrip().startswith("//") and ";" not in text
                break
            start = start if words else number
            words = f"{words} {piece.strip()}".strip()
            if piece is not last and words:
                yield Instruction(start, _bare(words))
                words = ""
    if words:
        yield Instruction(start, _bare(words))


def _bare(words: str) -> str:
    """Return an instruction without the names that stand in its brackets."""
    text = _FIRST_GROUP.sub("", words) if "GP1" in words.upper() else words
    if ":" not in text:
        return text
    while (shorter := _NAME.sub("", text)) != text:
        text = shorter
    return text


def _positions(file: str, text: str) -> dict[int, str]:
    positions: dict[int, str] = {}
    at, end = 0, len(text.rstrip())
    while at < end:
        position = _POSITION.match(text, at)
        if position is None:
            excerpt = text[at : at + 60].strip()
            raise ProgramError(
                f"{file}: /POS: expected P[number]{{ .. }};, got {shorten(excerpt)!r}"
            )
        number = int(position[1])
        if number in positions:
            raise ProgramError(f"{file}: /POS: expected each position once, got P[{number}] again")
        positions[number] = position[2]
        at = position.end()
    return positions


def split_at_comma(text: str) -> tuple[str, str]:
    """Return what stands before and behind the first comma outside of brackets."""
    depth = 0
    for at, letter in enumerate(text):
        depth += (letter in "([") - (letter in ")]")
        if letter == "," and depth == 0:
            return text[:at].strip(), text[at + 1 :].strip()
    return text.strip(), ""


def split_at_commas(text: str) -> list[str]:
    """Return the parts between commas outside of brackets."""
    parts, remaining = [], text.strip()
    while remaining:
        part, remaining = split_at_comma(remaining)
        parts.append(part)
    return parts
