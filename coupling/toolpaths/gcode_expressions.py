"""Values of G-code's parameters and expressions: RS274/NGC, and FANUC's macros where they agree."""

from __future__ import annotations

import math
import operator
import re
from collections.abc import Callable
from decimal import Decimal

# Parameters that are no control's; those up to the former are a sub-program's.
_LOCALS, _LAST, _LAST_NGC = 30, 999, 5000
# Where LinuxCNC takes two numbers for equal; other controls compare such by a rounding of theirs.
_EQUAL = 1e-4
_NUMBER = re.compile(r"\d+(?:\.\d*)?|\.\d+")
_EXPONENT = re.compile(r"E[-+]?\d")
_NAME = re.compile(r"<([^<>]{1,60})>")
_FUNCTION = re.compile(r"(ABS|ACOS|ASIN|ATAN|COS|EXISTS|EXP|FIX|FUP|LN|ROUND|SIN|SQRT|TAN)(?=\[)")
# A letter whose number is computed, no end of a name.
_COMPUTED = re.compile(
    rf"(?<![A-Z])(?!{_FUNCTION.pattern})([A-Z])(?=[-+]*(?:[#\[]|{_FUNCTION.pattern}))"
)
_OPERATOR = re.compile(r"\*\*|[-+*/]|MOD|EQ|NE|GE|GT|LE|LT|AND|XOR|OR")
# Operators bind as tightly as these numbers say, and from the left where alike.
_LEVELS = {
    "**": 5, "*": 4, "/": 4, "MOD": 4, "+": 3, "-": 3,
    "EQ": 2, "NE": 2, "GE": 2, "GT": 2, "LE": 2, "LT": 2, "AND": 1, "OR": 1, "XOR": 1,
}  # fmt: skip
_ARITHMETIC: dict[str, Callable[[float, float], float]] = {
    "+": operator.add, "-": operator.sub, "*": operator.mul, "/": operator.truediv, "**": math.pow,
}  # fmt: skip
_COMPARISONS: dict[str, Callable[[float, float], bool]] = {
    "EQ": operator.eq, "NE": operator.ne, "GE": operator.ge, "GT": operator.gt, "LE": operator.le,
    "LT": operator.lt,
}  # fmt: skip
_FUNCTIONS: dict[str, Callable[[float], float]] = {
    "ABS": abs,
    "ACOS": lambda x: math.degrees(math.acos(x)),
    "ASIN": lambda x: math.degrees(math.asin(x)),
    "COS": lambda x: math.cos(math.radians(x)),
    "EXP": math.exp,
    "FIX": math.floor,
    "FUP": math.ceil,
    "LN": math.log,
    "ROUND": lambda x: math.copysign(math.floor(abs(x) + 0.5), x),
    "SIN": lambda x: math.sin(math.radians(x)),
    "SQRT": math.sqrt,
    "TAN": lambda x: math.tan(math.radians(x)),
}


class Parameters:
    """Parameters of a program by number or name, with what a line does with them.

    Args:
        is_ngc: Whether the program is one of LinuxCNC, by its O-words or names; else what controls
            understand in different ways is refused.

    Example:
        >>> parameters = Parameters(is_ngc=False)
        >>> parameters.line("#1=[2+3*4]"), parameters.line("G1X#1Y[SQRT[9]*#1]")
        ('', 'G1X14.0Y42.0')
    """

    def __init__(self, is_ngc: bool) -> None:
        self._is_ngc = is_ngc
        self._values: dict[int | str, float] = {}
        self._calls: list[dict[int | str, float]] = []

    @property
    def depth(self) -> int:
        """Number of sub-programs that are being executed."""
        return len(self._calls)

    def call(self, arguments: list[float]) -> None:
        """Begin a sub-program with the arguments 1, 2, ..; the others up to 30 are 0."""
        local_values = {key: value for key, value in self._values.items() if self._is_local(key)}
        self._calls.append(local_values)
        for key in local_values:
            del self._values[key]
        self._values |= dict.fromkeys(range(1, _LOCALS + 1), 0.0)
        self._values |= dict(enumerate(arguments, start=1))

    def end_call(self, result: float) -> None:
        """End a sub-program, with its result as the parameter _value."""
        for key in [key for key in self._values if self._is_local(key)]:
            del self._values[key]
        self._values |= self._calls.pop()
        self._values["_VALUE"] = result

    def _is_local(self, key: int | str) -> bool:
        return key <= _LOCALS if isinstance(key, int) else not key.startswith("_")

    def line(self, code: str) -> str:
        """Return the words of a line with their numbers, and assign what it assigns thereafter.

        A line that is none of words and assignments is returned as it is.

        Args:
            code: Its words without comments and blanks, in capitals.

        Raises:
            ValueError: If a value is not known, or controls compute it in different ways.
        """
        words: list[str] = []
        assigned: dict[int | str, float] = {}
        place = 0
        while place < len(code):
            if code[place] == "#":
                key, place = self._key(code, place + 1)
                if code[place : place + 1] != "=":
                    raise ValueError(f"expected '=' behind a parameter, got {code[place:][:20]!r}")
                assigned[key], place = self._expression(code, place + 1)
            elif letter := _COMPUTED.match(code, place):
                value, place = self._value(code, letter.end())
                words.append(letter[0] + format(Decimal(repr(value)), "f"))
            elif code[place] == "[":
                return code  # of another language, and refused as such
            else:
                words.append(code[place])
                place += 1
        self._values |= assigned
        return "".join(words)

    def values(self, code: str) -> list[float]:
        """Return the values of expressions in brackets that follow each other.

        Raises:
            ValueError: If something else stands there.
        """
        values, place = [], 0
        while place < len(code):
            if code[place] != "[":
                raise ValueError(f"expected an expression in [ ], got {code[place:][:20]!r}")
            value, place = self._value(code, place)
            values.append(value)
        return values

    def _key(self, code: str, place: int) -> tuple[int | str, int]:
        """Return a parameter's number or name, and the place behind it."""
        if name := _NAME.match(code, place):
            return name[1], name.end()
        value, end = self._value(code, place)
        number = round(value)
        last = _LAST_NGC if self._is_ngc else _LAST
        if not 1 <= number <= last or abs(value - number) > 1e-9:
            raise ValueError(
                f"expected a parameter #1 to #{last}, got #{value:g}, one of the control: write the"
                " number that it has there"
            )
        return number, end

    def _value(self, code: str, place: int) -> tuple[float, int]:
        """Return the value that begins at a place, and the place behind it."""
        if code[place : place + 1] in ("-", "+"):
            value, end = self._value(code, place + 1)
            return (-value if code[place] == "-" else value), end
        if number := _NUMBER.match(code, place):
            if _EXPONENT.match(code, number.end()):
                raise ValueError(
                    f"expected numbers without exponents, got {code[place:][:20]!r}: write them out"
                )
            return float(number[0]), number.end()
        if code[place : place + 1] == "#":
            key, end = self._key(code, place + 1)
            if key not in self._values:
                name = f"<{key.lower()}>" if isinstance(key, str) else key
                raise ValueError(
                    f"expected a value of #{name} before, got none, the control may have one: assign"
                    " it in the program"
                )
            return self._values[key], end
        if code[place : place + 1] == "[":
            value, end = self._expression(code, place + 1)
            if code[end : end + 1] != "]":
                raise ValueError(f"expected an operator or ], got {code[end:][:20] or 'the end'!r}")
            return value, end + 1
        if function := _FUNCTION.match(code, place):
            return self._function(function[1], code, function.end())
        raise ValueError(
            f"expected a number, #, [ or a function, got {code[place:][:20] or 'the end'!r}"
        )

    def _expression(self, code: str, place: int, lowest: int = 1) -> tuple[float, int]:
        """Return the value of operators of a level or above it, and the place behind them."""
        value, place = self._value(code, place)
        logical: set[str] = set()
        while (sign := _OPERATOR.match(code, place)) and (level := _LEVELS[sign[0]]) >= lowest:
            if level == 1 and not self._is_ngc and logical - {sign[0]}:
                raise ValueError(
                    f"expected brackets between {logical.pop()} and {sign[0]}, got none"
                )
            logical |= {sign[0]} if level == 1 else set()
            right, place = self._expression(code, sign.end(), level + 1)
            value = self._combined(value, sign[0], right)
        return value, place

    def _combined(self, left: float, sign: str, right: float) -> float:
        if sign in _COMPARISONS:
            is_near = 0.0 < abs(left - right) < _EQUAL
            if is_near and not self._is_ngc:
                raise ValueError(
                    f"expected numbers to compare that are equal or differ by {_EQUAL:g}, got {left!r}"
                    f" {sign} {right!r}, which depends on the control's rounding: count whole numbers"
                )
            if is_near and sign in ("EQ", "NE"):
                return float(sign == "EQ")
            return float(_COMPARISONS[sign](left, right))
        if sign in ("AND", "OR", "XOR"):
            if not self._is_ngc and not {left, right} <= {0.0, 1.0}:
                raise ValueError(f"expected conditions beside {sign}, got {left:g} and {right:g}")
            first, second = left != 0.0, right != 0.0
            return float(
                {"AND": first and second, "OR": first or second}.get(sign, first != second)
            )
        try:
            if sign == "MOD":
                self._require_alike(sign, min(left, right))
                remainder = math.fmod(left, right)
                return remainder + abs(right) if remainder < 0.0 else remainder
            value = _ARITHMETIC[sign](left, right)
            if not math.isfinite(value):
                raise OverflowError("the result is too large")
        except (ArithmeticError, ValueError) as cause:
            raise ValueError(
                f"expected a number, got {left:g} {sign} {right:g}: {cause}"
            ) from cause
        return value

    def _function(self, name: str, code: str, place: int) -> tuple[float, int]:
        if name == "EXISTS":
            key, end = self._key(code, place + 2)
            if code[place : place + 2] != "[#" or code[end : end + 1] != "]":
                raise ValueError(
                    f"expected EXISTS[#<name>], got {code[place:][:20]!r} behind EXISTS"
                )
            return float(key in self._values), end + 1
        argument, end = self._value(code, place)
        try:
            if name == "ATAN":
                if code[end : end + 2] != "/[":
                    raise ValueError("give it as ATAN[y]/[x]")
                run, end = self._value(code, end + 1)
                value = math.degrees(math.atan2(argument, run))
                self._require_alike(name, value)
                return value, end
            if name in ("FIX", "FUP"):
                self._require_alike(name, argument)
            return float(_FUNCTIONS[name](argument)), end
        except (ArithmeticError, ValueError) as cause:
            raise ValueError(f"expected a number, got {name}[{argument:g}]: {cause}") from cause

    def _require_alike(self, name: str, value: float) -> None:
        if value < 0.0 and not self._is_ngc:
            raise ValueError(f"controls compute {name} of or to negative numbers in different ways")
