"""Arithmetic and comparisons of numbers, as all controllers do them."""

from __future__ import annotations

import math
import operator
from collections.abc import Callable

from coupling.errors import ProgramError

ARITHMETIC: dict[str, Callable[[float, float], float]] = {
    "+": operator.add,
    "-": operator.sub,
    "*": operator.mul,
    "/": operator.truediv,
    "DIV": lambda a, b: float(math.trunc(a / b)),
    "MOD": math.fmod,
}
ORDER: dict[str, Callable[[float, float], bool]] = {
    "<": operator.lt,
    ">": operator.gt,
    "<=": operator.le,
    ">=": operator.ge,
}
LOGIC: dict[str, Callable[[bool, bool], bool]] = {
    "AND": lambda a, b: a and b,
    "OR": lambda a, b: a or b,
    "XOR": operator.ne,
    "EXOR": operator.ne,
}
# The largest number of single precision.
LARGEST_REAL = 3.4e38


def compute_rounded(
    word: str, a: float, b: float, where: str, largest: float = LARGEST_REAL
) -> float:
    """Return what one of ARITHMETIC makes of two numbers.

    Args:
        word: The operator.
        a, b: The numbers.
        where: Place in the program, for messages.
        largest: Largest number that there may be.

    Raises:
        ProgramError: If the divisor is zero, or the result too large.

    Example:
        >>> compute_rounded("DIV", -7.0, 2.0, "line 1")
        -3.0
    """
    if word in ("/", "DIV", "MOD") and b == 0:
        raise ProgramError(f"{where}: expected a divisor other than 0, got 0")
    try:
        result = ARITHMETIC[word](a, b)
    except (ValueError, OverflowError) as cause:
        raise ProgramError(f"{where}: expected finite numbers for {word}, got others") from cause
    if not abs(result) <= largest:
        raise ProgramError(
            f"{where}: expected a number of at most {largest:g}, got a larger result"
        )
    return result
