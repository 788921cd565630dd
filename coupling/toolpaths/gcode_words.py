"""G-code as text: lines of words."""

from __future__ import annotations

import codecs
import io
import re
from collections.abc import Callable, Iterator
from dataclasses import dataclass, replace
from pathlib import Path

from coupling.errors import CaseError
from coupling.files.bounded_file import read_bounded
from coupling.files.formats import binary_name, other_format
from coupling.programs.reading import ReadingNotes
from coupling.toolpaths.gcode_macros import executed, has_macros
from coupling.toolpaths.gcode_syntax import common_words, is_text, refusal
from coupling.toolpaths.gcode_tnc import begins_tnc_program, is_blank

# What a file may hold at most [bytes].
_MAX_BYTES = 64_000_000
_WORD = re.compile(r"[A-Z][+-]?(?:\d+(?:\.\d*)?|\.\d+)")
# Controls that end a block with ";" execute the next one, others take it for a comment.
_WORDS = rf"(?:{_WORD.pattern})++"
_BEHIND_SEMICOLON = re.compile(rf"{_WORDS};+(?:{_WORDS};+)*?((?=[XYZ]|[^;]*G\d){_WORDS})(?:;.*)?")
# What parameters, expressions, O-words or loops have; comments may have it as well.
_MACROS = re.compile(
    r"[#\[]|^[^(;\n]*\bO[\w<> ]{1,60}(?:SUB|CALL)\b|^\s*DO\d", re.MULTILINE | re.IGNORECASE
)
# A printer's word E has a blank before it; a number that a program wrote has none.
_EXPONENT = re.compile(r"[\d.][eE]")
# A block that an operator may switch off, "/" or "/2", behind its number or before it.
_DELETED = re.compile(r"(N\d+)?/\d?")
# What DIN/ISO posts and printers' hosts write at the end of a line: an asterisk, and a check sum.
_LINE_END = re.compile(r"\*\d*$")
_PROGRAM_ENDS = (2.0, 30.0)
_END_OF_FILE = "\x1a"  # as DOS marks it
# Coordinates that end with a point, and whole ones without: the latter are increments on some controls.
_POINTED = re.compile(r"^[^(;\n]*[XYZIJKR][-+]?\d+\.(?!\d)", re.MULTILINE | re.IGNORECASE)
_POINTLESS = re.compile(r"^[^(;\n]*[XYZIJKR][-+]?0*[1-9]\d*(?![\d.])", re.MULTILINE | re.IGNORECASE)


@dataclass(frozen=True, slots=True)
class Block:
    """A line of a program.

    Attributes:
        line: Its number in the file, from 1.
        g: Numbers of its G-words.
        m: Numbers of its M-words.
        values: Its other words but line numbers, by their letter; a tool vector's by A3, B3, C3.
        statements: Its statements on the tool's direction, without blanks.
        tool: Name or number of the tool that it selects; empty if none.
    """

    line: int
    g: tuple[float, ...]
    m: tuple[float, ...]
    values: dict[str, float]
    statements: tuple[str, ...] = ()
    tool: str = ""


def read_blocks(file: Path, notes: ReadingNotes) -> Iterator[Block]:
    """Yield the lines of a G-code file that hold words, up to its end.

    The end is M2, M30, or a line of "%" behind the first line that holds words or such a mark.

    Args:
        notes: Notes on words left out and assumptions, added to.

    Raises:
        CaseError: With the number of the line that is not read, or what the file is if it is no G-code.
    """
    content = _content(file)
    if binary_name(content):
        raise CaseError(f"{file}: expected G-code, {other_format(content, ())}")
    # Comments are in any encoding; words are ASCII, and anything else in them is refused.
    text = content.removeprefix(codecs.BOM_UTF8).decode("latin-1").rstrip(_END_OF_FILE)
    _note_points(text, notes)

    def line_error(number: int, cause: ValueError) -> CaseError:
        if other := other_format(content, ["gcode"]):
            return CaseError(f"{file}: expected G-code, {other}")
        return CaseError(f"{file}: line {number}: {cause}")

    (lines, behind), has_begun = _lines(text, line_error), False
    is_tnc, begins_with_mark, line = False, False, "\n"
    for number, line in lines:
        if line[0] in "%:$" and (mark := _mark(line.strip(), has_begun, notes)):
            begins_with_mark = begins_with_mark or line[0] == "%"
            if mark == "end":
                _leave_out_rest(behind, "the closing %", notes)
                return
            has_begun = True
            if unit := re.search(r"\bG(7[01])\b", line):  # as DIN/ISO has it behind the name
                is_tnc = begins_tnc_program(line)
                centres = (90.1,) if is_tnc else ()
                yield Block(number, (float(unit[1]), *centres), (), {})
            continue
        try:
            block = _block(number, line, notes)
            if is_tnc and block is not None and is_blank(block.g):
                notes.leave_out("G30, G31 of a blank")
                continue
            if is_tnc and block is not None and block.tool:
                block = replace(block, m=(*block.m, 6.0))  # T is TOOL CALL there
        except ValueError as cause:
            raise line_error(number, cause) from cause
        if block is not None:
            has_begun = True
            yield block
            if any(m in _PROGRAM_ENDS for m in block.m):
                _leave_out_rest(behind, "the program's end", notes)
                return
    if begins_with_mark or not line.endswith("\n"):
        notes.assume(
            f"the file is whole, though {line.strip()[:20]!r}, without M2, M30 or %, ends it"
        )


def _lines(
    text: str, line_error: Callable[[int, ValueError], CaseError]
) -> tuple[Iterator[tuple[int, str]], Iterator[tuple[int, str]]]:
    """Return lines as they are executed, with their numbers from 1, and those behind the program's end.

    Args:
        line_error: Exception of a problem in a line, by its number.
    """
    lines = enumerate(io.StringIO(text, newline=None), start=1)
    if not _MACROS.search(text):
        return lines, lines
    written = [line for _, line in lines]
    codes = [_plain_code(line) for line in written]
    if not has_macros(codes):
        lines = enumerate(written, start=1)
        return lines, lines
    run = executed(codes, lambda place, cause: line_error(place + 1, cause))
    return ((k + 1, written[k] if code == codes[k] else f"{code}\n") for k, code in run), iter(())


def _plain_code(line: str) -> str:
    """Return a line's words without comments and blanks, in capitals; "" of a text."""
    if is_text(line):
        return ""
    try:
        plain = _strip_comments(line) if "(" in line or ";" in line else line
    except ValueError:
        return ""  # refused where it is executed
    return "".join(plain.split()).upper()


def _note_points(text: str, notes: ReadingNotes) -> None:
    """Note a coordinate without a point where others end with one: FANUC may take it for increments."""
    if _POINTED.search(text) and (word := _POINTLESS.search(text)):
        line = text.count("\n", 0, word.start()) + 1
        last = re.split(r"\s", word[0])[-1]
        notes.assume(
            f"line {line}: {last} is a whole number of millimetres or inches, as if a point ended it"
        )


def _content(file: Path) -> bytes:
    return read_bounded(file, _MAX_BYTES, CaseError)


def _mark(line: str, has_begun: bool, notes: ReadingNotes) -> str | None:
    """Return whether a line that begins so is a mark of the program's "begin" or "end", or None."""
    if line.startswith("%"):
        if has_begun:
            return "end"
        if line != "%":
            notes.leave_out(f"the name {line[:20]}")
        return "begin"
    if has_begun or not re.fullmatch(r":\d+.*|\$[\w.]+%?", line) or line in ("$H", "$X"):
        return None
    notes.leave_out(f"the name {line[:20]}")
    return "begin"


def _leave_out_rest(lines: Iterator[tuple[int, str]], where: str, notes: ReadingNotes) -> None:
    """Note the lines behind a program's end, which a control does not execute."""
    count = sum(line.strip() not in ("", "%") for _, line in lines)
    if count:
        notes.left_out[f"lines behind {where}"] += count


def _block(number: int, line: str, notes: ReadingNotes) -> Block | None:
    plain = _strip_comments(line) if "(" in line or ";" in line else line
    if ";" in line and (further := _BEHIND_SEMICOLON.fullmatch("".join(line.split()).upper())):
        raise ValueError(
            f"expected one block in a line, got {further[1][:20]} behind ';': write it in a line of its"
            " own, or take the comment out"
        )
    code = "".join(plain.split()).upper()
    if not code:
        return None
    if "/" in code and (deleted := _DELETED.match(code)):
        code = (deleted[1] or "") + code[deleted.end() :]
        notes.leave_out("the switch of / (such lines are executed)")
    if "*" in code:
        code = _LINE_END.sub("", code)
    g, m, values = [], [], {}
    statements: tuple[str, ...] = ()
    tool = ""
    words = _WORD.findall(code)
    if "".join(words) != code:
        common = common_words(line, code, notes)
        words, statements, tool = _WORD.findall(common.code), common.statements, common.tool
        if "".join(words) != common.code:
            raise ValueError(refusal(common.code, _end_of_words(common.code)))
        values = dict(common.components)
        if len(values) < len(common.components):
            raise ValueError(
                "expected one of each A3, B3, C3, got two: write the one that is meant"
            )
    for word in words:
        letter, value = word[0], float(word[1:])
        if letter == "G":
            g.append(value)
        elif letter == "M":
            m.append(value)
        elif letter != "N":
            if letter in values:
                raise ValueError(
                    f"expected one word {letter}, got two: write the one that is meant"
                )
            values[letter] = value
        elif "." in word and (g or m or values):
            raise ValueError(
                f"expected the line's number before its words, got {word}, a call of blocks by their"
                " number: let the post-processor write its moves out"
            )
    if "T" in values:
        tool = f"{values['T']:g}"
    if "E" in values and _EXPONENT.search(plain):
        raise ValueError(
            "expected numbers without exponents, got a digit and E: write them out, or a blank before a"
            " word E"
        )
    if not (g or m or values or statements or tool):
        return None
    return Block(number, tuple(g), tuple(m), values, statements, tool)


def _end_of_words(code: str) -> int:
    """Return where the first words of a line end."""
    end = 0
    while word := _WORD.match(code, end):
        end = word.end()
    return end


def _strip_comments(line: str) -> str:
    """Return a line without comments: in parentheses, which may be nested, or behind a semicolon.

    A comment that is opened twice and closed once ends with its line if nothing is behind it.

    Raises:
        ValueError: If a comment is not closed.
    """
    code, depth, opened, end = [], 0, 0, 0
    for piece in re.split(r"([();])", line):
        if piece == "(":
            opened = opened if depth else end
            depth += 1
        elif piece == ")" and depth:
            depth -= 1
        elif piece == ";" and not depth:
            break
        elif not depth:
            code.append(piece)
        end += len(piece)
    comment = line[opened:].rstrip()
    if depth and not (comment.endswith(")") and comment.count(")") == 1):
        raise ValueError(
            "expected a comment to be closed, got '(' without ')': close it in its line"
        )
    return "".join(code)


def require_letters(values: dict[str, float], is_arc: bool) -> None:
    """Refuse the words of a move that are not read; P1 of an arc is one turn at most, as without.

    Raises:
        ValueError: If there is one.
    """
    if is_arc and "P" in values and (turns := values.pop("P")) != 1.0:
        raise ValueError(f"expected an arc of one turn at most, got P{turns:g}: write each turn")
    known_letters = "XYZIJKR" if is_arc else "XYZ"
    for letter in values:
        if letter not in known_letters:
            remedy = "take it out"
            if letter == "L":  # of a label, a sub-program or repetitions
                remedy = "let the post-processor write the moves out that it calls or repeats"
            raise ValueError(
                f"expected {', '.join(known_letters)} here, got the word {letter}: {remedy}"
            )
