"""Texts of KRL: lines, routines, and their blocks."""

from __future__ import annotations

import re
from collections.abc import Iterator
from dataclasses import dataclass, field

from coupling.errors import ProgramError
from coupling.programs.program import ProgramFile
from coupling.programs.text import shorten

_WORD = re.compile(r"[$A-Za-z_][\w$]*")
_HEADING = re.compile(
    r"(?:GLOBAL\s+)?(DEF|DEFFCT)\s+(?:[A-Za-z]\w*(?:\s*\[[^\]]*\])?\s+)?([$A-Za-z_][\w$]*)\s*(?:\(([^)]*)\))?",
    re.IGNORECASE,
)
_SHARED = re.compile(r"^[ \t]*(?:DECL\s+)?(?:CONST\s+)?GLOBAL\s", re.IGNORECASE | re.MULTILINE)
_CALL = re.compile(r"([A-Za-z_]\w*)\s*\(")
_FOR = re.compile(
    r"FOR\s+([A-Za-z_]\w*)\s*=\s*(.+?)\s+TO\s+(.+?)(?:\s+STEP\s+(.+))?", re.IGNORECASE
)
# Blocks in each other, at most.
_MAX_NESTING = 60
# What ends a block, by what begins it.
_BLOCK_ENDS = {
    "IF": ("ENDIF",),
    "FOR": ("ENDFOR",),
    "WHILE": ("ENDWHILE",),
    "REPEAT": ("UNTIL",),
    "LOOP": ("ENDLOOP",),
    "SWITCH": ("ENDSWITCH",),
}
_BLOCK_PARTS = {"IF": ("ELSE",), "SWITCH": ("CASE", "DEFAULT")}
_LONE_WORDS = "ELSE ENDIF ENDFOR ENDWHILE REPEAT LOOP ENDLOOP ENDSWITCH DEFAULT EXIT"
_LONE_KEYWORDS = frozenset(_LONE_WORDS.split())
_INNER_KEYWORDS = frozenset(
    word for words in (*_BLOCK_ENDS.values(), *_BLOCK_PARTS.values()) for word in words
)


@dataclass(frozen=True)
class KrlLine:
    """A statement on its line.

    Attributes:
        where: File and number of the line.
        text: Statement, without comments.
        word: First name in it, upper case.
    """

    where: str
    text: str
    word: str

    @property
    def remaining(self) -> str:
        """What stands behind the word."""
        return self.text[len(self.word) :].strip()


@dataclass
class KrlBlock:
    """A statement that holds others.

    Attributes:
        line: KrlLine that begins it.
        parts: Lines of its parts with what stands in them: IF and ELSE, the cases of SWITCH.
        end: KrlLine that ends it.
    """

    line: KrlLine
    parts: list[tuple[KrlLine, list[Statement]]]
    end: KrlLine

    @property
    def loop(self) -> re.Match[str]:
        """Variable, begin, end and step of a FOR."""
        loop = _FOR.fullmatch(self.line.text)
        if loop is None:
            raise ProgramError(
                f"{self.line.where}: expected FOR variable = begin TO end, got"
                f" {shorten(self.line.text)!r}"
            )
        return loop


Statement = KrlLine | KrlBlock


@dataclass
class Routine:
    """A program or function of a module.

    Attributes:
        name: Name as it is written.
        module: Name of its module, upper case.
        parameters: Names in upper case, each with whether its value alone is handed over (IN).
        lines: Statements.
        is_global: Whether other modules may call it: GLOBAL, the first of its module, or of its name.
    """

    name: str
    module: str
    parameters: tuple[tuple[str, bool], ...]
    lines: list[KrlLine]
    is_global: bool
    _statements: list[Statement] | None = field(default=None, repr=False)

    @property
    def statements(self) -> list[Statement]:
        """Statements in their blocks.

        Raises:
            ProgramError: If a block has no begin or no end.
        """
        if self._statements is None:
            lines = iter(self.lines)
            self._statements, _ = _statements(lines, None, 0)
        return self._statements


def lines_of(file: ProgramFile) -> Iterator[KrlLine]:
    """Yield the statements of a file, without comments and headers."""
    for number, text in enumerate(file.text.splitlines(), start=1):
        bare = _without_comment(text).strip()
        if bare and not bare.startswith("&"):
            word = _WORD.match(bare)
            yield KrlLine(f"{file.name}: line {number}", bare, word[0].upper() if word else "")


def _without_comment(text: str) -> str:
    if '"' not in text:
        return text.partition(";")[0]
    quoted = False
    for k, letter in enumerate(text):
        if letter == '"':
            quoted = not quoted
        elif letter == ";" and not quoted:
            return text[:k]
    return text


def routines_of(file: ProgramFile) -> list[Routine]:
    """Return the routines of a .src; statements outside of any are one without a name.

    Raises:
        ProgramError: If a heading is none.
    """
    module = file.name.rsplit(".", 1)[0].upper()
    routines: list[Routine] = []
    current: Routine | None = None
    for line in lines_of(file):
        heading = _heading(line)
        if heading is not None:
            name, parameters, is_global = heading
            is_global = is_global or not routines or name.upper() == module
            current = Routine(name, module, parameters, [], is_global)
            routines.append(current)
        elif line.word in ("END", "ENDFCT"):
            current = None
        else:
            if current is None and line.word not in ("DECL", "EXT", "EXTFCT", "IMPORT"):
                if routines:
                    raise ProgramError(
                        f"{line.where}: expected DEF behind END, got {shorten(line.text)!r}"
                    )
                current = Routine("", module, (), [], True)
                routines.append(current)
            if current is not None:
                current.lines.append(line)
    return routines


def called_names(text: str) -> set[str]:
    """Return the names, upper case, that stand before brackets in a text: of programs, among others."""
    return {name.upper() for name in _CALL.findall(text)}


def shares_data(text: str) -> bool:
    r"""Return whether a .dat declares data of all programs.

    Example:
        >>> shares_data("DEFDAT POINTS PUBLIC\nDECL GLOBAL FRAME XP1={X 1.0}\nENDDAT")
        True
    """
    return _SHARED.search(text) is not None


def _heading(line: KrlLine) -> tuple[str, tuple[tuple[str, bool], ...], bool] | None:
    if line.word not in ("DEF", "DEFFCT", "GLOBAL"):
        return None
    heading = _HEADING.fullmatch(line.text)
    if heading is None:
        if line.word == "GLOBAL":
            return None
        raise ProgramError(
            f"{line.where}: expected a name behind {line.word}, got {shorten(line.remaining)!r}"
        )
    parameters = []
    for part in (heading[3] or "").split(","):
        name, _, way = part.partition(":")
        if name.strip():
            key = re.sub(r"\[[^\]]*\]?", "", name).strip().upper()
            parameters.append((key, way.strip().upper() == "IN"))
    return heading[2], tuple(parameters), line.word == "GLOBAL"


def _statements(
    lines: Iterator[KrlLine], begin: KrlLine | None, depth: int
) -> tuple[list[Statement], KrlLine | None]:
    """Return the statements of a block up to the line that ends this part of it, and that line."""
    if depth > _MAX_NESTING and begin is not None:
        raise ProgramError(
            f"{begin.where}: expected at most {_MAX_NESTING} blocks in each other, got more"
        )
    word = begin.word if begin is not None else ""
    ends = (*_BLOCK_ENDS.get(word, ()), *_BLOCK_PARTS.get(word, ()))
    statements: list[Statement] = []
    for line in lines:
        if line.word in _LONE_KEYWORDS and line.remaining.strip(" :") and not _is_variable(line):
            raise ProgramError(
                f"{line.where}: expected {line.word} alone in its line, got {shorten(line.text)!r}"
            )
        if line.word in ends:
            return statements, line
        if line.word in _INNER_KEYWORDS and not _is_variable(line):
            opened = f"in {begin.word} of {begin.where}" if begin is not None else "without a begin"
            raise ProgramError(f"{line.where}: expected no {line.word} {opened}, got one")
        statements.append(_block(lines, line, depth) if line.word in _BLOCK_ENDS else line)
    if begin is not None:
        raise ProgramError(f"{begin.where}: expected {ends[0]} behind it, got {begin.word} alone")
    return statements, None


def _is_variable(line: KrlLine) -> bool:
    """Return whether a word that ends a part of a block is a name here."""
    return line.remaining.startswith(("=", ".", "["))


def _block(lines: Iterator[KrlLine], begin: KrlLine, depth: int) -> KrlBlock:
    parts: list[tuple[KrlLine, list[Statement]]] = []
    line = begin
    while True:
        inner, end = _statements(lines, begin, depth + 1)
        parts.append((line, inner))
        assert end is not None
        if end.word in _BLOCK_ENDS[begin.word]:
            return KrlBlock(begin, parts, end)
        line = end
