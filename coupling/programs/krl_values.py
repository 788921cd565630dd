"""Statements of KRL, and the points in braces that they give names."""

from __future__ import annotations

import re
from collections.abc import Iterator

from coupling.errors import ProgramError
from coupling.programs.text import real, shortened

ASSIGNED = re.compile(
    r"(?:DECL\s+)?(?:GLOBAL\s+)?(?:(?:FRAME|POS|E6POS|AXIS|E6AXIS)\s+)?"
    r"([$A-Z_][\w$]*(?:\s*\[\s*\d+\s*\])?)\s*=\s*(\{[^{}]*\})",
    re.IGNORECASE,
)


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
