"""Expressions of FANUC programs: numbers, registers and conditions, of which some are not known."""

from __future__ import annotations

import re
from collections.abc import Callable

from coupling.errors import ProgramError
from coupling.programs.arithmetic import ORDER, compute_rounded
from coupling.programs.text import real, shorten
from coupling.programs.unknown import Unknown

_TOKEN = re.compile(
    r"\s*((?:\d+\.?\d*|\.\d+)(?:[eE][-+]?\d+)?|'[^']*'|<>|<=|>=|[-+*/=<>!()\[\],]"
    r"|\$[\w$.]+(?:\[[^\[\]]*\][\w$.]*)*|[A-Za-z_]\w*)"
)
# Brackets in each other; the language allows five.
_MAX_NESTING = 20
# How tightly operators bind.
_COMPARING = 3
_PRECEDENCE = {
    "OR": 1,
    "AND": 2,
    **dict.fromkeys(("=", "<>", "<", ">", "<=", ">="), _COMPARING),
    **dict.fromkeys(("+", "-"), 4),
    **dict.fromkeys(("*", "/", "DIV", "MOD"), 5),
}
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
                f"{where}: expected an expression, got {shorten(bare[at:])!r} in {shorten(bare)!r}"
            )
        tokens.append(token[1])
        at = token.end()
    expression = _Expression(tokens, lookup, where, bare)
    value = expression.expression()
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
            f"{self.where}: expected an expression of registers and numbers, got {shorten(word)!r}"
            f" in {shorten(self.text)!r}"
        )

    def _next(self, *words: str) -> str:
        """Return and go over the next token if it is one of these, else return an empty one."""
        if self.tokens and self.tokens[0].upper() in words:
            return self.tokens.pop(0).upper()
        return ""

    def expression(self, lowest: int = 0) -> Value:
        """Go over an expression whose operators bind more tightly than this; return its value."""
        value = self._factor()
        while self.tokens and (power := _PRECEDENCE.get(self.tokens[0].upper(), 0)) > lowest:
            word = self.tokens.pop(0).upper()
            value = self._apply_operator(value, word, self.expression(power))
            if power == _COMPARING and self.tokens and _PRECEDENCE.get(self.tokens[0]) == power:
                raise self.error(self.tokens[0])
        return value

    def _apply_operator(self, left_value: Value, word: str, right: Value) -> Value:
        """Return what an operator makes of two values; one of AND, OR may decide alone."""
        is_logical, decisive = word in ("AND", "OR"), word == "OR"
        for value in (left_value, right):
            if is_logical and not isinstance(value, Unknown) and bool(value) == decisive:
                return decisive
        for value in (left_value, right):
            if isinstance(value, Unknown):
                return value
        if is_logical:
            return not decisive
        if word in ("=", "<>") and isinstance(left_value, str) == isinstance(right, str):
            return (left_value == right) == (word == "=")
        if not isinstance(left_value, float) or not isinstance(right, float):
            raise self.error(word)
        return (
            ORDER[word](left_value, right)
            if word in ORDER
            else compute_rounded(word, left_value, right, self.where)
        )

    def _factor(self) -> Value:
        self.depth += 1
        if not self.tokens or self.depth > _MAX_NESTING:
            raise self.error(self.tokens[0] if self.tokens else "its end")
        token = self.tokens.pop(0)
        value = self._value(token)
        self.depth -= 1
        return value

    def _value(self, token: str) -> Value:
        if token == "-":
            return self._apply_operator(0.0, "-", self._factor())
        if token == "!":
            value = self._factor()
            return value if isinstance(value, Unknown) else not value
        if token == "(":
            value = self.expression()
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
        values = [self.expression()]
        while self._next(","):
            values.append(self.expression())
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
        raise ProgramError(f"{where}: expected a whole number, got {shorten(str(value))}")
    return int(value)
