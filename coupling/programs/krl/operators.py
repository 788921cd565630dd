"""Operators of KRL on values that are known."""

from __future__ import annotations

import operator
from collections.abc import Callable

from coupling.errors import ProgramError
from coupling.programs.krl.values import (
    Unknown,
    UnknownValueError,
    Value,
    composed,
    described,
    is_number,
)

# How tightly operators bind; comparisons bind least, below AND and OR.
PRECEDENCE = {
    ":": 8,
    "*": 7,
    "/": 7,
    "+": 6,
    "-": 6,
    "AND": 5,
    "B_AND": 5,
    "EXOR": 4,
    "B_EXOR": 4,
    "OR": 3,
    "B_OR": 3,
    "==": 2,
    "<>": 2,
    "<": 2,
    ">": 2,
    "<=": 2,
    ">=": 2,
}
# The mode of operation where a program runs by itself: #AUT and #EX, whichever.
AUTOMATIC = "#AUT or #EX"
_MANUAL = ("#T1", "#T2")
_COMPARED: dict[str, Callable[[float, float], bool]] = {
    "<": operator.lt,
    ">": operator.gt,
    "<=": operator.le,
    ">=": operator.ge,
}
_LOGIC: dict[str, Callable[[bool, bool], bool]] = {
    "AND": lambda a, b: a and b,
    "OR": lambda a, b: a or b,
    "EXOR": operator.ne,
}
_BITS: dict[str, Callable[[int, int], int]] = {
    "B_AND": operator.and_,
    "B_OR": operator.or_,
    "B_EXOR": operator.xor,
}
_ARITHMETIC: dict[str, Callable[[float, float], float]] = {
    "+": operator.add,
    "-": operator.sub,
    "*": operator.mul,
}
_LARGEST_INT, _LARGEST_REAL = 2**31 - 1, 3.4e38


def applied(word: str, left: Value, right: Value, where: str) -> Value:
    """Return what an operator makes of two values.

    Raises:
        ProgramError: If it is not for such values, or the result is too large.
        UnknownValueError: If one is not known.
    """
    for side in (left, right):
        if isinstance(side, Unknown):
            raise UnknownValueError(side)
    if word == ":":
        return composed(left, right, where)
    if word in ("==", "<>"):
        return _equal(left, right, where) == (word == "==")
    if word in _LOGIC and isinstance(left, bool) and isinstance(right, bool):
        return _LOGIC[word](left, right)
    if word in _BITS and type(left) is int and type(right) is int:
        return _BITS[word](left, right)
    if not (is_number(left) and is_number(right)):
        raise ProgramError(
            f"{where}: expected values for {word}, got {described(left)} and {described(right)}:"
            " write brackets around comparisons"
        )
    assert not isinstance(left, str | dict | Unknown)
    assert not isinstance(right, str | dict | Unknown)
    if word in _COMPARED:
        return _COMPARED[word](left, right)
    if word == "/":
        return _bounded(_quotient(left, right, where), where)
    if word not in _ARITHMETIC:
        raise ProgramError(f"{where}: expected TRUE or FALSE for {word}, got numbers")
    return _bounded(_ARITHMETIC[word](left, right), where)


def negated(word: str, value: Value, where: str) -> Value:
    """Return a value with a minus, NOT or B_NOT before it.  Raises as `applied`."""
    if isinstance(value, Unknown):
        raise UnknownValueError(value)
    if word == "NOT" and isinstance(value, bool):
        return not value
    if word == "B_NOT" and type(value) is int:
        return ~value
    if word == "-" and is_number(value):
        assert not isinstance(value, str | dict)
        return -value
    raise ProgramError(f"{where}: expected a value for {word}, got {described(value)}")


def _equal(left: Value, right: Value, where: str) -> bool:
    if AUTOMATIC in (left, right):
        mode = right if left == AUTOMATIC else left
        if mode not in _MANUAL:
            raise UnknownValueError(Unknown("$MODE_OP"))
        return False
    if isinstance(left, dict) or isinstance(right, dict):
        raise ProgramError(f"{where}: expected single values beside ==, got a structure")
    if isinstance(left, bool) != isinstance(right, bool) or isinstance(left, str) != isinstance(
        right, str
    ):
        raise ProgramError(
            f"{where}: expected values of one kind beside ==, got {described(left)} and"
            f" {described(right)}: write brackets around comparisons"
        )
    return left == right


def _quotient(left: float, right: float, where: str) -> float:
    if right == 0:
        raise ProgramError(f"{where}: expected a divisor other than 0, got 0")
    if type(left) is int and type(right) is int:
        if left % right:
            # Whether variables of other files are INT or REAL is not told.
            raise ProgramError(
                f"{where}: expected a whole quotient of INT, got {left}/{right}: write {left}.0 for the"
                " quotient of REAL"
            )
        return left // right
    return left / right


def _bounded(value: float, where: str) -> float:
    largest = _LARGEST_INT if type(value) is int else _LARGEST_REAL
    if not abs(value) <= largest:
        raise ProgramError(f"{where}: expected numbers of at most {largest:g}, got a larger result")
    return value
