"""Functions of KRL that a controller brings along."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from math import acos, atan2, cos, degrees, radians, sin, sqrt, tan

from coupling.errors import ProgramError
from coupling.programs.krl.values import Value, invert_frame, number

_OF_NUMBERS: dict[str, tuple[int, Callable[..., float]]] = {
    "ABS": (1, abs),
    "SQRT": (1, sqrt),
    "SIN": (1, lambda angle: sin(radians(angle))),
    "COS": (1, lambda angle: cos(radians(angle))),
    "TAN": (1, lambda angle: tan(radians(angle))),
    "ACOS": (1, lambda value: degrees(acos(value))),
    "ATAN2": (2, lambda y, x: degrees(atan2(y, x))),
}
FUNCTIONS = frozenset((*_OF_NUMBERS, "INV_POS"))


def call_function(name: str, arguments: Sequence[Value], where: str) -> Value:
    """Return the result of one of FUNCTIONS; angles are degrees.

    Raises:
        ProgramError: If its arguments are none for it.

    Example:
        >>> call_function("SQRT", [9.0], "line 1")
        3.0
    """
    count, function = _OF_NUMBERS.get(name, (1, None))
    if len(arguments) != count:
        raise ProgramError(
            f"{where}: expected {count} values for {name}, got {len(arguments)} of them"
        )
    if function is None:
        return invert_frame(arguments[0], where)
    # An argument that is not known raises UnknownValueError.
    numbers = [number(value, where) for value in arguments]
    try:
        return function(*numbers)
    except ValueError as cause:
        raise ProgramError(
            f"{where}: expected a value that {name} is defined for, got {numbers[0]:g}"
        ) from cause
