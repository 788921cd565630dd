"""Declarations of KRL: variables, structures, enumerations, signals."""

from __future__ import annotations

import re
from collections.abc import Iterator
from dataclasses import dataclass

from coupling.errors import ProgramError
from coupling.programs.krl.syntax import KrlLine
from coupling.programs.text import shorten

_SIMPLE = frozenset(["INT", "REAL", "BOOL", "CHAR", "FRAME", "POS", "E6POS", "AXIS", "E6AXIS"])
# Types of the pendant's motions, which are declared without DECL at times.
_PENDANT = frozenset(["FDAT", "LDAT", "PDAT", "BASIS_SUGG_T"])
_MODIFIERS = frozenset(("DECL", "GLOBAL", "CONST", "PUBLIC"))
# What stands behind a modifier and declares no variable.
_OTHERS = frozenset(("STRUC", "ENUM", "SIGNAL", "INTERRUPT"))
_TYPED = re.compile(
    r"((?:(?:DECL|GLOBAL|CONST|PUBLIC)\s+)*)([A-Za-z_]\w*)\s*(?:\[[\d, ]*\])?\s+(.+)", re.IGNORECASE
)
_NAME = re.compile(r"\s*([$A-Za-z_][\w$]*)\s*(?:\[[^\]]*\])?\s*")


@dataclass(frozen=True)
class Declaration:
    """Variables of a type that a line declares.

    Attributes:
        kind: Type in upper case.
        is_global: Whether all modules know them.
        names: Their names in upper case.
        value: Text of the last one's first value, and with its element what it is given to; None where
            there is none.
    """

    kind: str
    is_global: bool
    names: tuple[str, ...]
    value: tuple[str, str] | None = None


def declaration_of(line: KrlLine) -> Declaration | None:
    """Return what a line declares; None where it is no declaration.

    Raises:
        ProgramError: If it begins like one and is none.
    """
    modified = line.word in _MODIFIERS
    if not modified and line.word not in _SIMPLE and line.word not in _PENDANT:
        return None
    match = _TYPED.fullmatch(line.text)
    if match is None or (not modified and match[3].lstrip().startswith(("=", "(", "."))):
        if modified:
            raise ProgramError(
                f"{line.where}: expected a type and a name, got {shorten(line.text)!r}"
            )
        return None
    if match[2].upper() in _OTHERS:
        return None
    words = match[1].upper().split()
    names, value = [], None
    for target, first in _declarators(match[3], line.where):
        name = _NAME.fullmatch(target)
        if name is None:
            raise ProgramError(f"{line.where}: expected a name, got {shorten(target.strip())!r}")
        names.append(name[1].upper())
        value = (target.strip(), first) if first else value
    return Declaration(match[2].upper(), "GLOBAL" in words, tuple(names), value)


def _declarators(text: str, where: str) -> Iterator[tuple[str, str]]:
    """Yield names with their elements, and the text of a first value, which stands last."""
    before, _, value = text.partition("=")
    targets = _split(before)
    for target in targets[:-1]:
        yield target, ""
    yield targets[-1], value.strip()


def _split(text: str) -> list[str]:
    """Return what stands between the commas outside of brackets."""
    return re.split(r",(?![^\[]*\])", text)


def structure_of(line: KrlLine) -> tuple[str, dict[str, str]]:
    """Return name, and types of the components, of a STRUC.

    Raises:
        ProgramError: If it is none.
    """
    text = re.sub(r"^(GLOBAL\s+)?STRUC\s+", "", line.text, flags=re.IGNORECASE)
    name, *others = text.split(maxsplit=1)
    kinds: dict[str, str] = {}
    kind = ""
    for part in _split(" ".join(others)):
        words = re.sub(r"\[[^\]]*\]", "", part).split()
        if not 1 <= len(words) <= 2 or not (kind or len(words) == 2):
            raise ProgramError(
                f"{line.where}: expected STRUC, a name, types and components, got"
                f" {shorten(line.text)!r}"
            )
        kind = words[0].upper() if len(words) == 2 else kind
        kinds[words[-1].upper()] = kind
    return name.upper(), kinds
