"""APT cutter location data as text: statements of a word and its arguments."""

from __future__ import annotations

import codecs
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path

from coupling.errors import CaseError
from coupling.files.bounded_file import read_bounded
from coupling.files.formats import binary_name, other_format

# What a file may hold at most [bytes].
_MAX_BYTES = 128_000_000
# Words whose statement is text to its end, with or without a slash.
_TEXTS = ("PARTNO", "PPRINT", "REMARK", "LETTER", "INSERT", "TITLES", "TPRINT")


@dataclass(frozen=True)
class Statement:
    """A statement.

    Attributes:
        line: Number of its first line in the file, from 1.
        word: Its major word, in capitals.
        arguments: Words and numbers behind the slash, in capitals.
    """

    line: int
    word: str
    arguments: tuple[str, ...]


def read_content(file: Path) -> bytes:
    """Return what stands in an APT file.

    Raises:
        CaseError: If it cannot be read, or is no text.
    """
    content = read_bounded(file, _MAX_BYTES, CaseError)
    if binary_name(content):
        raise CaseError(f"{file}: expected APT, {other_format(content, ())}")
    return content


def statements_of(content: bytes) -> Iterator[Statement]:
    """Yield the statements; what follows `$$` is a comment, `$` goes on in the next line.

    Raises:
        ValueError: If the file ends within a statement.
    """
    # Comments are in any encoding; statements are ASCII, and anything else in them is refused.
    text = content.removeprefix(codecs.BOM_UTF8).decode("latin-1")
    unfinished, first, is_remark = "", 0, False
    for number, line in enumerate(text.splitlines(), start=1):
        # A comment of Creo, `$$->`, may go on in the next line as well.
        remark = is_remark or line.lstrip().startswith("$$->")
        if remark:
            is_remark = line.rstrip().endswith("$") and not line.rstrip().endswith("$$")
            continue
        code = line.partition("$$")[0]
        if not unfinished and _is_text(code):
            code, mark = code.rstrip(), ""
        else:
            code, mark, _ = code.partition("$")
        first = first if unfinished else number
        unfinished += code.upper()
        if not mark and unfinished.strip():
            yield _statement(first, unfinished)
        if not mark:
            unfinished = ""
    if unfinished.strip():
        raise ValueError(
            f"line {first}: expected the statement to go on behind $, got the end of the file"
        )


def _is_text(code: str) -> bool:
    return code.lstrip()[:6].upper() in _TEXTS


def _statement(line: int, code: str) -> Statement:
    if _is_text(code):
        text = code.strip()
        return Statement(line, text[:6], (text[6:].strip(" \t/"),))
    word, slash, words = code.partition("/")
    arguments = tuple(part.strip() for part in words.split(",")) if slash else ()
    return Statement(line, " ".join(word.split()), arguments)
