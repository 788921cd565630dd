"""Operators of KRL on values that are known."""

from __future__ import annotations

import operator
from collections.abc import Callable

from coupling.errors import ProgramError
from coupling.programs.arithmetic import LOGIC, ORDER, compute_rounded
from coupling.programs.krl.values import (
    UnknownValueError,
    Value,
    compose_frames,
    describe_value,
    is_number,
)
from coupling.programs.unknown import Unknown

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
_BITS: dict[str, Callable[[int, int], int]] = {
    "B_AND": operator.and_,
    "B_OR": operator.or_,
    "B_EXOR": operator.xor,
}
_LARGEST_INT = 2**31 - 1


def apply_binary(word: str, left_value: Value, right: Value, where: str) -> Value:
    """Return what an operator makes of two values.

    Raises:
        ProgramError: If it is not for such values, or the result is too large.
        UnknownValueError: If one is not known.
    """
    for side in (left_value, right):
        if isinstance(side, Unknown):
            raise UnknownValueError(side)
    if word == ":":
        return compose_frames(left_value, right, where)
    if word in ("==", "<>"):
        return _equal(left_value, right, where) == (word == "==")
    if word in LOGIC and isinstance(left_value, bool) and isinstance(right, bool):
        return LOGIC[word](left_value, right)
    if word in _BITS and type(left_value) is int and type(right) is int:
        return _BITS[word](left_value, right)
    if not (is_number(left_value) and is_number(right)):
        raise ProgramError(
            f"{where}: expected values for {word}, got {describe_value(left_value)} and"
            f" {describe_value(right)}: write brackets around comparisons"
        )
    assert not isinstance(left_value, str | dict | Unknown)
    assert not isinstance(right, str | dict | Unknown)
    if word in ORDER:
        return ORDER[word](left_value, right)
    if word not in ("+", "-", "*", "/"):
        raise ProgramError(f"{where}: expected TRUE or FALSE for {word}, got numbers")
    if not (type(left_value) is int and type(right) is int):
        return compute_rounded(word, left_value, right, where)
    result = compute_rounded(word, left_value, right, where, _LARGEST_INT)
    if result != int(result):
        # Whether variables of other files are INT or REAL is not told.
        raise ProgramError(
            f"{where}: expected a whole quotient of INT, got {left_value}/{right}: write {left_value}.0"
            " for the quotient of REAL"
        )
    return int(result)


def apply_unary(word: str, value: Value, where: str) -> Value:
    """Return a value with a minus, NOT or B_NOT before it.  Raises as `apply_binary`."""
    if isinstance(value, Unknown):
        raise UnknownValueError(value)
    if word == "NOT" and isinstance(value, bool):
        return not value
    if word == "B_NOT" and type(value) is int:
        return ~value
    if word == "-" and is_number(value):
        assert not isinstance(value, str | dict)
        return -value
    raise ProgramError(f"{where}: expected a value for {word}, got {describe_value(value)}")


def _equal(left_value: Value, right: Value, where: str) -> bool:
    if AUTOMATIC in (left_value, right):
        mode = right if left_value == AUTOMATIC else left_value
        if mode not in _MANUAL:
            raise UnknownValueError(Unknown("$MODE_OP"))
        return False
    if isinstance(left_value, dict) or isinstance(right, dict):
        raise ProgramError(f"{where}: expected single values beside ==, got a structure")
    if isinstance(left_value, bool) != isinstance(right, bool) or isinstance(
        left_value, str
    ) != isinstance(right, str):
        raise ProgramError(
            f"{where}: expected values of one kind beside ==, got {describe_value(left_value)} and"
            f" {describe_value(right)}: write brackets around comparisons"
        )
    return left_value == right
