"""Numbers, names and lines of program texts."""

from __future__ import annotations

import re
from collections.abc import Collection, Sequence

import numpy as np

from coupling.errors import ProgramError

# Controllers keep real numbers in single precision; a larger one is a mistake.
LARGEST = 1e8

NUMBER = r"[-+]?(?:\d+(?:\.\d*)?|\.\d+)(?:[eE][-+]?\d+)?"
_NUMBER = re.compile(NUMBER)
_WORD = re.compile(r"[A-Za-z][A-Za-z0-9_]*")


def format_fixed(value: float, decimals: int) -> str:
    """Return a number with so many decimals, and no minus before a zero.

    Example:
        >>> format_fixed(-0.00004, 3), format_fixed(12.34567, 3)
        ('0.000', '12.346')
    """
    text = f"{value:.{decimals}f}"
    return text[1:] if text.startswith("-") and not text.strip("-0.") else text


def numbers(values: Sequence[float] | np.ndarray, decimals: int) -> str:
    """Return numbers (n,) with commas between them."""
    return ",".join(format_fixed(float(value), decimals) for value in values)


def real(text: str, where: str) -> float:
    """Return a number as a controller keeps it, in single precision.

    Args:
        text: The number.
        where: Place in the file, for the message.

    Raises:
        ProgramError: If it is none.
    """
    if not _NUMBER.fullmatch(text.strip()):
        raise ProgramError(f"{where}: expected a number, got {shorten(text.strip())!r}")
    value = float(text)
    if not abs(value) <= LARGEST:
        raise ProgramError(f"{where}: expected a number of at most {LARGEST:g}, got {value:g}")
    return float(np.float32(value))


def shorten(text: str, most: int = 40) -> str:
    """Return a text that fits into a message."""
    return text if len(text) <= most else f"{text[:most]}..."


def require_name(name: str, longest: int, reserved: Collection[str], maker: str) -> None:
    """Refuse a name that a controller would not take for a program.

    Raises:
        ProgramError: If it is too long, holds other characters, or is a word of the language.
    """
    if not _WORD.fullmatch(name) or len(name) > longest:
        raise ProgramError(
            f"name: expected a letter, then letters, digits and _, at most {longest} for {maker}, got"
            f" {shorten(name)!r}: give another one with --name"
        )
    if name.upper() in reserved:
        raise ProgramError(
            f"name: expected none of {maker}'s own words, got {name!r}: give another one with --name"
        )


def require_lines(text: str, longest: int, where: str) -> None:
    """Refuse a text with a line longer than its language allows."""
    for number, line in enumerate(text.splitlines(), start=1):
        if len(line) > longest:
            raise ProgramError(
                f"{where}: line {number}: expected at most {longest} characters, got {len(line)}"
            )
