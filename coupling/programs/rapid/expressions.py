"""Words of RAPID and the expressions that they make."""

from __future__ import annotations

import json
import re
from bisect import bisect_right
from typing import Any

from coupling.errors import ProgramError
from coupling.programs.rapid.syntax import (
    Argument,
    Brackets,
    Component,
    Element,
    Expression,
    FunctionCall,
    Literal,
    Name,
    OperatorExpression,
)
from coupling.programs.rapid.values import NO_AXIS, Value, single, text_of
from coupling.programs.text import shorten

# What stands between words, comments with it, and a word.
_WORD = re.compile(
    r"""(?:\s|![^\n]*)*
    (?:(?P<number>0(?:[xX][0-9A-Fa-f]{1,13}|[bB][01]{1,52}|[oO][0-7]{1,17})
        |(?:\d+(?:\.\d*)?|\.\d+)(?:[eE][-+]?\d+)?)
    |(?P<name>[^\W\d]\w*)
    |(?P<text>"(?:[^"\n]|"")*")
    |(?P<sign>:=|<>|<=|>=|[-+*/=<>(),;:.\[\]{}\\?%|])
    |(?P<other>.))?""",
    re.VERBOSE | re.DOTALL,
)
# Brackets and operators in each other, at most.
_MAX_NESTING = 40
# How tightly operators hold their operands; NOT stands before all of an AND.
_BINDING = {
    **dict.fromkeys(("OR", "XOR"), 1),
    "AND": 2,
    **dict.fromkeys(("=", "<>", "<", ">", "<=", ">="), 4),
    **dict.fromkeys(("+", "-"), 5),
    **dict.fromkeys(("*", "/", "DIV", "MOD"), 6),
}
_NOT_PRECEDENCE, _SIGN_PRECEDENCE = 2, 6


def _refuse_constant(word: str) -> float:
    raise ValueError(word)


# Brackets of numbers alone are JSON, which is decoded at once: most of a long program are those.
_NUMBERS = json.JSONDecoder(parse_int=float, parse_constant=_refuse_constant)


class Words:
    """A text, word by word, and its expressions.

    Attributes:
        kind: Kind of the next word: number, name, text, sign, other, or end.
        word: The next word; a name in capitals.
        written: The next word in the letters of the text.
    """

    def __init__(self, text: str, file: str) -> None:
        """Begin with the first word of a text; `file` is for messages."""
        self._text, self._file = text, file
        self._lines = [match.start() for match in re.finditer("\n", text)]
        self._at = self._end = self._depth = 0
        self.kind = self.word = self.written = ""
        self.advance()

    @property
    def where(self) -> str:
        """The place of the next word."""
        return f"{self._file}: line {bisect_right(self._lines, self._at - 1) + 1}"

    @property
    def next_sign(self) -> str:
        """The sign behind the next word; empty where there is none."""
        match = _WORD.match(self._text, self._end)
        return (match["sign"] or "") if match else ""

    def advance(self) -> str:
        """Go on by a word, and return the one that was next in the letters of the text."""
        passed = self.written
        match = _WORD.match(self._text, self._end)
        assert match is not None  # all of the pattern is optional
        self.kind = match.lastgroup or "end"
        self.written = match[self.kind] if self.kind != "end" else ""
        self.word = self.written.upper() if self.kind == "name" else self.written
        self._at, self._end = match.end() - len(self.written), match.end()
        return passed

    def takes(self, *words: str) -> bool:
        """Go on if the next word is one of these, and return whether it is."""
        if self.word not in words or self.kind in ("text", "end"):
            return False
        self.advance()
        return True

    def require(self, word: str, what: str = "") -> None:
        """Go on by a word that must stand here."""
        if not self.takes(word):
            self.refuse(what or repr(word))

    def name(self, what: str) -> str:
        """Go on by a name, and return it."""
        if self.kind != "name":
            self.refuse(what)
        return self.advance()

    def refuse(self, expected: str) -> None:
        """Raise what tells that something else was expected here."""
        got = "the end of the file" if self.kind == "end" else repr(shorten(self.written))
        raise ProgramError(f"{self.where}: expected {expected}, got {got}")

    def expression(self, binding: int = 0) -> Expression:
        """Go on by an expression whose operators hold tighter than `binding`."""
        self._depth += 1
        if self._depth > _MAX_NESTING:
            raise ProgramError(
                f"{self.where}: expected at most {_MAX_NESTING} brackets in each other"
            )
        left_operand = self._operand()
        while self.kind in ("name", "sign"):
            operator = self.word
            power = _BINDING.get(operator, 0)
            if power <= binding:
                break
            self.advance()
            left_operand = OperatorExpression(operator, (left_operand, self.expression(power)))
        self._depth -= 1
        return left_operand

    def listed(self, closing: str) -> tuple[Expression, ...]:
        """Go on by expressions with commas between them and what closes them."""
        items = [self.expression()]
        while self.takes(","):
            items.append(self.expression())
        self.require(closing)
        return tuple(items)

    def arguments(self) -> tuple[Argument, ...]:
        """Go on by the arguments of a routine; a comma may be missing around options."""
        arguments: list[Argument] = []
        while self.kind != "end" and (self.kind == "text" or self.word not in (";", ")")):
            is_divided = self.takes(",") or not arguments
            if self.takes("\\"):
                arguments.append(self._option())
            elif is_divided or arguments[-1].option:
                arguments.append(Argument("", self._argument()))
            else:
                break
        return tuple(arguments)

    def _argument(self) -> Expression:
        # A star is a target whose numbers are nowhere in the text.
        if self.word == "*" and self.kind == "sign":
            return Name(self.advance())
        return self.expression()

    def _option(self) -> Argument:
        option = self.name("the name of an option").upper()
        if self.takes("?"):
            return Argument(option, Name(self.name("the name of a parameter")), True)
        return Argument(option, self.expression() if self.takes(":=") else None)

    def _operand(self) -> Expression:
        if self.kind == "number":
            where = self.where
            text = self.advance()
            has_base = text[1:2] in tuple("xXbBoO")
            return Literal("num", number(float(int(text, 0) if has_base else text), where))
        if self.kind == "text":
            return Literal("string", text_of(self.advance()[1:-1].replace('""', '"'), self.where))
        if self.word == "[":
            return self._brackets()
        if self.takes("("):
            inner = self.expression()
            self.require(")")
            return self._parts(inner)
        if self.takes("+"):
            return self.expression(_SIGN_PRECEDENCE - 1)
        if self.takes("-"):
            operand = self.expression(_SIGN_PRECEDENCE - 1)
            if isinstance(operand, Literal) and isinstance(operand.value, float):
                return Literal("num", -operand.value)
            return OperatorExpression("-", (operand,))
        if self.takes("NOT"):
            return OperatorExpression("NOT", (self.expression(_NOT_PRECEDENCE - 1),))
        if self.takes("TRUE"):
            return Literal("bool", True)
        if self.takes("FALSE"):
            return Literal("bool", False)
        name = self.name("a value")
        if self.takes("("):
            arguments = self.arguments()
            self.require(")", "a comma or ')'")
            return self._parts(FunctionCall(name, arguments))
        return self._parts(Name(name))

    def _parts(self, whole: Expression) -> Expression:
        """Go on by the components and indices behind data."""
        count = 0
        while self.kind == "sign" and self.word in (".", "{"):
            count += 1
            if count > _MAX_NESTING:
                self.refuse(f"at most {_MAX_NESTING} components")
            if self.takes("."):
                whole = Component(whole, self.name("a component"))
            else:
                self.advance()
                whole = Element(whole, self.listed("}"))
        return whole

    def _brackets(self) -> Expression:
        where = self.where
        try:
            items, end = _NUMBERS.raw_decode(self._text, self._at)
            value = _constant(items, where)
        except (ValueError, RecursionError):
            pass
        else:
            self._end = end
            self.advance()
            return Literal("", value)
        self.advance()
        listed = self.listed("]")
        if all(isinstance(item, Literal) for item in listed):
            return Literal("", tuple(item.value for item in listed if isinstance(item, Literal)))
        return Brackets(listed)


def number(value: float, where: str) -> float:
    """Return a number of the text as a controller keeps it.

    Raises:
        ProgramError: If it is too large.
    """
    return value if value == NO_AXIS else single(value, where)


def _constant(item: Any, where: str, depth: int = 0) -> Value:
    """Return what was decoded as values.

    Raises:
        ValueError: If it is not of numbers alone.
    """
    if isinstance(item, float):
        return item if item == NO_AXIS else single(item, where)
    if isinstance(item, list) and item and depth < _MAX_NESTING:
        return tuple(_constant(part, where, depth + 1) for part in item)
    raise ValueError("not of numbers alone")
