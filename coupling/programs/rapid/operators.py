"""Operators of RAPID, on values of which some may not be known."""

from __future__ import annotations

from coupling.errors import ProgramError
from coupling.programs.arithmetic import LOGIC, ORDER, compute_rounded
from coupling.programs.rapid.values import (
    Data,
    Value,
    format_value,
    text_of,
)
from coupling.programs.unknown import Unknown

# The value that decides, whatever the other operand is.
_DECISIVE_VALUES = {"AND": False, "OR": True}


def apply_operator(operator: str, operands: list[Data], where: str) -> Data:
    """Return what an operator makes of one or two operands.

    What is made of a value that is not known is not known, but for AND and OR that the other decides.

    Raises:
        ProgramError: If the operator has no such operands.

    Example:
        >>> sides = [Data("num", 3.0), Data("pos", (1.0, 2.0, 0.0))]
        >>> apply_operator("*", sides, "here")
        Data(kind='pos', value=(3.0, 6.0, 0.0), rank=0)
    """
    for data in operands:
        if operator in _DECISIVE_VALUES and data.value is _DECISIVE_VALUES[operator]:
            return data
    for data in operands:
        if isinstance(data.value, Unknown):
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
    raise ProgramError(
        f"{where}: expected an operand of {operator}, got {format_value(data.value)}"
    )


def _of_two(operator: str, a: Data, b: Data, where: str) -> tuple[str, Value]:
    if operator in ("=", "<>"):
        if type(a.value) is type(b.value):
            return "bool", (a.value == b.value) == (operator == "=")
    elif operator in LOGIC:
        if isinstance(a.value, bool) and isinstance(b.value, bool):
            return "bool", LOGIC[operator](a.value, b.value)
    elif _is_number(a.value) and _is_number(b.value):
        assert isinstance(a.value, float)
        assert isinstance(b.value, float)
        if operator in ORDER:
            return "bool", ORDER[operator](a.value, b.value)
        return "dnum" if "dnum" in (a.kind, b.kind) else "num", compute_rounded(
            operator, a.value, b.value, where
        )
    elif operator == "+" and isinstance(a.value, str) and isinstance(b.value, str):
        return "string", text_of(a.value + b.value, where)
    elif (value := _of_space(operator, a, b, where)) is not None:
        return value
    raise ProgramError(
        f"{where}: expected operands of {operator}, got {format_value(a.value)} and"
        f" {format_value(b.value)}"
    )


def _is_number(value: Value) -> bool:
    return isinstance(value, float) and not isinstance(value, bool)


def _vector(value: Value) -> tuple[float, float, float] | None:
    if isinstance(value, tuple) and len(value) == 3:
        x, y, z = value
        if isinstance(x, float) and isinstance(y, float) and isinstance(z, float):
            return x, y, z
    return None


def _of_space(operator: str, a: Data, b: Data, where: str) -> tuple[str, Value] | None:
    """Return what an operator makes of vectors; None where it makes nothing."""
    u, v = _vector(a.value), _vector(b.value)
    if u is not None and v is not None and operator in ("+", "-"):
        sign = 1.0 if operator == "+" else -1.0
        return "pos", tuple(x + sign * y for x, y in zip(u, v, strict=True))
    if operator == "*" and u is None and v is not None and isinstance(a.value, float):
        return "pos", tuple(a.value * x for x in v)
    if operator in ("*", "/") and u is not None and isinstance(b.value, float):
        return "pos", tuple(compute_rounded(operator, x, b.value, where) for x in u)
    return None
