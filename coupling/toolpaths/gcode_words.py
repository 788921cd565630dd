"""G-code as text: lines of words, and what of them is not read."""

from __future__ import annotations

import codecs
import re
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path

from coupling.errors import CaseError, reason_of

# What a file may hold at most [bytes].
_LARGEST = 64_000_000
_COMMENT = re.compile(r"\([^()]*\)")
_WORD = re.compile(r"([A-Z])([+-]?(?:\d{1,12}(?:\.\d{0,12})?|\.\d{1,12}))")
# G-words that make a program what is not read here, by what they are.
_REFUSED = {
    5.0: "a spline",
    10.0: "an offset set by the program",
    28.0: "a return to the machine's reference",
    30.0: "a return to the machine's reference",
    41.0: "cutter radius compensation",
    42.0: "cutter radius compensation",
    53.0: "machine coordinates",
    92.0: "a shift of the coordinates",
    93.0: "inverse time feed",
    95.0: "feed per revolution",
}
_SUBPROGRAMS = (97.0, 98.0, 99.0)


@dataclass(frozen=True)
class Block:
    """A line of a program.

    Attributes:
        line: Its number in the file, from 1.
        g: Numbers of its G-words.
        m: Numbers of its M-words.
        values: Its other words but line numbers, by their letter.
    """

    line: int
    g: tuple[float, ...]
    m: tuple[float, ...]
    values: dict[str, float]


def read_blocks(file: Path) -> Iterator[Block]:
    """Yield the lines of a G-code file that hold words.

    Raises:
        CaseError: With the number of the line that is not read.
    """
    try:
        with file.open("rb") as stream:
            content = stream.read(_LARGEST + 1)
    except OSError as cause:
        raise CaseError(f"{file}: cannot be read: {reason_of(cause)}") from cause
    if len(content) > _LARGEST:
        raise CaseError(f"{file}: expected at most {_LARGEST} bytes, got more")
    # Comments are in any encoding; words are ASCII, and anything else in them is refused.
    text = content.removeprefix(codecs.BOM_UTF8).decode("latin-1")
    for number, line in enumerate(re.split(r"\r\n|\n|\r", text), start=1):
        try:
            block = _block(number, line)
        except ValueError as cause:
            raise CaseError(f"{file}: line {number}: {cause}") from cause
        if block is not None:
            yield block


def _block(number: int, line: str) -> Block | None:
    code = _COMMENT.sub("", line).partition(";")[0]
    code = re.sub(r"[ \t]+", "", code).upper()
    if code in ("", "%"):
        return None
    words, end = [], 0
    for found in _WORD.finditer(code):
        if found.start() != end:
            break
        words.append((found[1], float(found[2])))
        end = found.end()
    if end != len(code):
        raise ValueError(
            "expected words of a letter and a number, got"
            f" {code[end : end + 20]!r}: variables, expressions and sub-programs are not read"
        )
    values: dict[str, float] = {}
    for letter, value in words:
        if letter in "GMN":
            continue
        if letter in values:
            raise ValueError(f"expected one word {letter}, got two")
        values[letter] = value
    g, m = (tuple(value for letter, value in words if letter == kind) for kind in "GM")
    for value in g:
        if value in _REFUSED:
            raise ValueError(f"expected no G{value:g}, got {_REFUSED[value]}: take it out")
    if any(value in _SUBPROGRAMS for value in m):
        raise ValueError("expected one program, got a call of another")
    return Block(number, g, m, values)
