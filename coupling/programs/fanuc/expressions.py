"""Expressions of FANUC programs: numbers, registers and conditions, of which some are not known."""

from __future__ import annotations

import re
from collections.abc import Callable

from coupling.errors import ProgramError
from coupling.programs.arithmetic import ORDER, computed
from coupling.programs.text import real, shortened
from coupling.programs.unknown import Unknown

_TOKEN = re.compile(
    r"\s*((?:\d+\.?\d*|\.\d+)(?:[eE][-+]?\d+)?|'[^']*'|<>|<=|>=|[-+*/=<>!()\[\],]"
    r"|\$[\w$.]+(?:\[[^\[\]]*\][\w$.]*)*|[A-Za-z_]\w*)"
)
# Brackets in each other; the language allows five.
_DEEPEST = 20
_CONSTANTS = {"ON": True, "OFF": False, "TRUE": True, "FALSE": False}


Value = float | bool | str | Unknown
# Function from the name of a register and its indices to its value.
Lookup = Callable[[str, tuple[int, ...]], Value]


def evaluate(text: str, lookup: Lookup, where: str) -> Value:
    """Return the value of an expression.

    Args:
        text: The expression.
        lookup: Function that gives the values of registers.
        where: Place in the program, for messages.

    Raises:
        ProgramError: If it is none.

    Example:
        >>> evaluate("(2+3*4)DIV 4", lambda name, indices: Unknown(name), "here")
        3.0
        >>> evaluate("1=2 AND DI[3]=ON", lambda name, indices: Unknown(name), "here")
        False
        >>> evaluate("DI[3]", lambda name, indices: Unknown(f"{name}{list(indices)}"), "here")
        Unknown(name='DI[3]', step=0)
    """
    tokens, at = [], 0
    bare = text.strip()
    while at < len(bare):
        token = _TOKEN.match(bare, at)
        if token is None:
            raise ProgramError(
                f"{where}: expected an expression, got {shortened(bare[at:])!r} in {shortened(bare)!r}"
            )
        tokens.append(token[1])
        at = token.end()
    expression = _Expression(tokens, lookup, where, bare)
    value = expression.disjunction()
    if expression.tokens:
        raise expression.error(expression.tokens[0])
    return value


class _Expression:
    """What is still to be read of an expression."""

    def __init__(self, tokens: list[str], lookup: Lookup, where: str, text: str) -> None:
        self.tokens, self.lookup, self.where, self.text = tokens, lookup, where, text
        self.depth = 0

    def error(self, word: str) -> ProgramError:
        return ProgramError(
            f"{self.where}: expected an expression of registers and numbers, got {shortened(word)!r}"
            f" in {shortened(self.text)!r}"
        )

    def _next(self, *words: str) -> str:
        """Return and go over the next token if it is one of these, else return an empty one."""
        if self.tokens and self.tokens[0].upper() in words:
            return self.tokens.pop(0).upper()
        return ""

    def disjunction(self) -> Value:
        value = self._conjunction()
        while self._next("OR"):
            other = self._conjunction()
            value = True if True in (value, other) else _logical(value, other, any)
        return value

    def _conjunction(self) -> Value:
        value = self._comparison()
        while self._next("AND"):
            other = self._comparison()
            value = False if _is_off(value) or _is_off(other) else _logical(value, other, all)
        return value

    def _comparison(self) -> Value:
        value = self._sum()
        sign = self._next("=", "<>", "<", ">", "<=", ">=")
        return _compared(value, sign, self._sum(), self) if sign else value

    def _sum(self) -> Value:
        value = self._product()
        while sign := self._next("+", "-"):
            value = _computed(value, sign, self._product(), self)
        return value

    def _product(self) -> Value:
        value = self._factor()
        while sign := self._next("*", "/", "DIV", "MOD"):
            value = _computed(value, sign, self._factor(), self)
        return value

    def _factor(self) -> Value:
        self.depth += 1
        if not self.tokens or self.depth > _DEEPEST:
            raise self.error(self.tokens[0] if self.tokens else "its end")
        token = self.tokens.pop(0)
        value = self._value(token)
        self.depth -= 1
        return value

    def _value(self, token: str) -> Value:
        if token == "-":
            return _computed(0.0, "-", self._factor(), self)
        if token == "!":
            value = self._factor()
            return value if isinstance(value, Unknown) else not value
        if token == "(":
            value = self.disjunction()
            if not self._next(")"):
                raise self.error("no )")
            return value
        if token[0] == "'":
            return token[1:-1]
        if token[0].isdigit() or token[0] == ".":
            return real(token, self.where)
        if token.upper() in _CONSTANTS:
            return _CONSTANTS[token.upper()]
        if token[0] == "$":
            return Unknown(token)
        if not token[0].isalpha() or not self._next("["):
            raise self.error(token)
        return self._register(token.upper())

    def _register(self, name: str) -> Value:
        values = [self.disjunction()]
        while self._next(","):
            values.append(self.disjunction())
        if not self._next("]"):
            raise self.error("no ]")
        for value in values:
            if isinstance(value, Unknown):
                return value
        where = f"{self.where}: {name}[]"
        return self.lookup(name, tuple(whole_number(value, where) for value in values))


def whole_number(value: Value, where: str) -> int:
    """Return a value that is the number of something.

    Raises:
        ProgramError: If it is not known or not whole.
    """
    if isinstance(value, Unknown):
        raise ProgramError(
            f"{where}: expected a number that the program sets, got {value.name}: set it before"
        )
    if isinstance(value, str) or value != int(value):
        raise ProgramError(f"{where}: expected a whole number, got {shortened(str(value))}")
    return int(value)


def _is_off(value: Value) -> bool:
    return not isinstance(value, Unknown) and not value


def _logical(a: Value, b: Value, join: Callable[[tuple[Value, Value]], bool]) -> Value:
    for value in (a, b):
        if isinstance(value, Unknown):
            return value
    return join((a, b))


def _compared(a: Value, sign: str, b: Value, within: _Expression) -> Value:
    if isinstance(a, Unknown):
        return a
    if isinstance(b, Unknown):
        return b
    if isinstance(a, str) or isinstance(b, str):
        if type(a) is not type(b) or sign not in ("=", "<>"):
            raise within.error(sign)
        return (a == b) == (sign == "=")
    return ORDER[sign](a, b) if sign in ORDER else (a == b) == (sign == "=")


def _computed(a: Value, sign: str, b: Value, within: _Expression) -> Value:
    if isinstance(a, Unknown):
        return a
    if isinstance(b, Unknown):
        return b
    if isinstance(a, str) or isinstance(b, str):
        raise within.error(sign)
    return computed(sign, float(a), float(b), within.where)
