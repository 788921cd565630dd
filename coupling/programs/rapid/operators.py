"""Operators of RAPID, on values of which some may not be known."""

from __future__ import annotations

import math
from collections.abc import Callable

from coupling.errors import ProgramError
from coupling.programs.poses import product
from coupling.programs.program import HERE
from coupling.programs.rapid.values import (
    Data,
    UnknownData,
    Value,
    pose_of,
    shown,
    text_of,
    value_of,
)

_ARITHMETIC: dict[str, Callable[[float, float], float]] = {
    "+": lambda a, b: a + b,
    "-": lambda a, b: a - b,
    "*": lambda a, b: a * b,
    "/": lambda a, b: a / b,
    "DIV": lambda a, b: float(math.trunc(a / b)),
    "MOD": math.fmod,
}
_ORDER: dict[str, Callable[[float, float], bool]] = {
    "<": lambda a, b: a < b,
    ">": lambda a, b: a > b,
    "<=": lambda a, b: a <= b,
    ">=": lambda a, b: a >= b,
}
_LOGIC: dict[str, Callable[[bool, bool], bool]] = {
    "AND": lambda a, b: a and b,
    "OR": lambda a, b: a or b,
    "XOR": lambda a, b: a != b,
}
# The value that decides, whatever the other operand is.
_DECISIVE = {"AND": False, "OR": True}


def operated(operator: str, operands: list[Data], where: str) -> Data:
    """Return what an operator makes of one or two operands.

    What is made of a value that is not known is not known, but for AND and OR that the other decides.

    Raises:
        ProgramError: If the operator has no such operands.

    Example:
        >>> sides = [Data("num", 3.0), Data("pos", (1.0, 2.0, 0.0))]
        >>> operated("*", sides, "here")
        Data(kind='pos', value=(3.0, 6.0, 0.0), rank=0)
    """
    for data in operands:
        if operator in _DECISIVE and data.value is _DECISIVE[operator]:
            return data
    for data in operands:
        if isinstance(data.value, UnknownData):
            return Data("", data.value)
    if len(operands) == 1:
        return _of_one(operator, operands[0], where)
    a, b = operands
    kind, value = _of_two(operator, a, b, where)
    return Data(kind, value)


def _of_one(operator: str, data: Data, where: str) -> Data:
    if operator == "NOT" and isinstance(data.value, bool):
        return Data("bool", not data.value)
    vector = _vector(data.value)
    if operator == "-" and vector is not None:
        return Data("pos", tuple(-x for x in vector))
    if operator == "-" and isinstance(data.value, float) and not isinstance(data.value, bool):
        return Data(data.kind, -data.value)
    raise ProgramError(f"{where}: expected an operand of {operator}, got {shown(data.value)}")


def _of_two(operator: str, a: Data, b: Data, where: str) -> tuple[str, Value]:
    if operator in ("=", "<>"):
        if type(a.value) is type(b.value):
            return "bool", (a.value == b.value) == (operator == "=")
    elif operator in _LOGIC:
        if isinstance(a.value, bool) and isinstance(b.value, bool):
            return "bool", _LOGIC[operator](a.value, b.value)
    elif _is_number(a.value) and _is_number(b.value):
        assert isinstance(a.value, float)
        assert isinstance(b.value, float)
        if operator in _ORDER:
            return "bool", _ORDER[operator](a.value, b.value)
        return "dnum" if "dnum" in (a.kind, b.kind) else "num", _computed(
            operator, a.value, b.value, where
        )
    elif operator == "+" and isinstance(a.value, str) and isinstance(b.value, str):
        return "string", text_of(a.value + b.value, where)
    elif (value := _of_space(operator, a, b, where)) is not None:
        return value
    raise ProgramError(
        f"{where}: expected operands of {operator}, got {shown(a.value)} and {shown(b.value)}"
    )


def _is_number(value: Value) -> bool:
    return isinstance(value, float) and not isinstance(value, bool)


def _computed(operator: str, a: float, b: float, where: str) -> float:
    if operator in ("/", "DIV", "MOD") and b == 0.0:
        raise ProgramError(f"{where}: expected a divisor, got 0")
    try:
        return _ARITHMETIC[operator](a, b)
    except (ValueError, OverflowError) as cause:
        raise ProgramError(
            f"{where}: expected finite operands of {operator}, got {a:g} and {b:g}"
        ) from cause


def _vector(value: Value) -> tuple[float, float, float] | None:
    if isinstance(value, tuple) and len(value) == 3:
        x, y, z = value
        if isinstance(x, float) and isinstance(y, float) and isinstance(z, float):
            return x, y, z
    return None


def _of_space(operator: str, a: Data, b: Data, where: str) -> tuple[str, Value] | None:
    """Return what an operator makes of vectors and rotations; None where it makes nothing."""
    u, v = _vector(a.value), _vector(b.value)
    if u is not None and v is not None and operator in ("+", "-"):
        sign = 1.0 if operator == "+" else -1.0
        return "pos", tuple(x + sign * y for x, y in zip(u, v, strict=True))
    if operator == "*" and u is not None and v is not None:
        (a1, a2, a3), (b1, b2, b3) = u, v
        return "pos", (a2 * b3 - a3 * b2, a3 * b1 - a1 * b3, a1 * b2 - a2 * b1)
    if operator == "*" and u is None and v is not None and isinstance(a.value, float):
        return "pos", tuple(a.value * x for x in v)
    if operator in ("*", "/") and u is not None and isinstance(b.value, float):
        return "pos", tuple(_computed(operator, x, b.value, where) for x in u)
    if operator == "*" and a.kind == b.kind == "orient":
        origin = value_of(HERE)
        assert isinstance(origin, tuple)
        first, second = (pose_of((origin[0], data.value), where) for data in (a, b))
        turned = value_of(product(first, second))
        assert isinstance(turned, tuple)
        return "orient", turned[1]
    return None
