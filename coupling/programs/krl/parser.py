"""Texts of KRL to expressions: tokens, and a parser by precedence."""

from __future__ import annotations

import re
from functools import lru_cache

from coupling.errors import ProgramError
from coupling.programs.krl.expressions import (
    Bracketed,
    Call,
    Constant,
    Expression,
    Negation,
    Nothing,
    Operation,
    Reference,
)
from coupling.programs.krl.operators import PRECEDENCE
from coupling.programs.krl.values import REAL_KEYS, Aggregate, Value
from coupling.programs.text import NUMBER, real, shorten

_TOKEN = re.compile(
    r"""\s*(?:([$A-Za-z_][\w$]*)            # a name
    |(\d+(?:\.\d*)?(?:[eE][-+]?\d+)?|\.\d+(?:[eE][-+]?\d+)?)
    |(\#\s*\w+)                             # a word of an enumeration
    |("[^"]*")
    |('[BHDbhd]?[0-9A-Fa-f]+')              # a number in binary, hexadecimal or decimal digits
    |(<=|>=|<>|==|[-+*/:<>=(){}\[\],.]))""",
    re.VERBOSE,
)
_PLAIN_AGGREGATE = re.compile(r"\s*\{\s*(?:[A-Za-z_]\w*\s*:)?([^{}\"':#]*)\}")
_FIELD = re.compile(rf"\s*([A-Za-z_]\w*)\s+({NUMBER})\s*")
_INTEGER = re.compile(r"[-+]?\d+")
# Brackets in each other, and operators or components in a row, at most.
_MAX_NESTING, _MAX_OPERANDS = 40, 200
_BASES = {"B": 2, "H": 16, "D": 10}


def parse_expression(text: str, where: str) -> Expression:
    """Return the expression of a whole text.

    Raises:
        ProgramError: If it is none.

    Example:
        >>> parse_expression("P[2]:{Y 40}", "line 1").word
        ':'
    """
    expression, remaining = leading(text, where)
    if remaining:
        raise ProgramError(f"{where}: expected an expression, got {shorten(text.strip())!r}")
    return expression


def leading(text: str, where: str) -> tuple[Expression, str]:
    """Return the expression that a text begins with, and what stands behind it.

    Raises as `parse_expression`.
    """
    plain = _PLAIN_AGGREGATE.match(text)
    if plain is not None:
        behind = text[plain.end() :].strip()
        if not behind.startswith(":"):
            return Constant(_plain_aggregate(plain[1], where)), behind
    try:
        return _leading(text)
    except ProgramError as cause:
        raise ProgramError(f"{where}: {cause}") from None


@lru_cache(maxsize=20_000)
def _leading(text: str) -> tuple[Expression, str]:
    parser = _Parser(text)
    return parser.expression(), text[parser.begin :].strip()


def _plain_aggregate(text: str, where: str) -> Aggregate:
    """Return the structure of numbers alone, as most points are written."""
    fields: Aggregate = {}
    for part in text.split(","):
        field = _FIELD.fullmatch(part)
        if field is None:
            words = part.split()
            if len(words) == 2 and words[1].upper() in ("TRUE", "FALSE"):
                fields[words[0].upper()] = words[1].upper() == "TRUE"
                continue
            what = "a letter and a number" if len(words) != 2 else "a number"
            got = part.strip() if len(words) != 2 else words[1]
            raise ProgramError(f"{where}: expected {what}, got {shorten(got)!r}")
        key = field[1].upper()
        if key in fields:
            raise ProgramError(f"{where}: expected each component once, got {key} twice")
        fields[key] = _literal(field[2], where, key in REAL_KEYS)
    return fields


def _literal(text: str, where: str, is_real: bool = False) -> float:
    value = real(text, where)
    return value if is_real or not _INTEGER.fullmatch(text) else int(text)


class _Parser:
    """Reads an expression from the begin of a text."""

    def __init__(self, text: str) -> None:
        self.text, self.begin, self.depth, self.joined = text, 0, 0, 0
        self._advance()

    def _advance(self) -> None:
        """Look at the next token: its kind, 1 to 6, and word; kind 0 where there is none."""
        token = _TOKEN.match(self.text, self.begin)
        self.kind, self.word, self.end = 0, "", self.begin
        if token is not None and token.lastindex is not None:
            self.kind, self.word, self.end = token.lastindex, token[token.lastindex], token.end()
            if self.kind == 1:
                self.word = self.word.upper()

    def _take(self) -> str:
        word, self.begin = self.word, self.end
        self._advance()
        return word

    def _expect(self, word: str) -> None:
        if self.word != word or self.kind != 6:
            raise ProgramError(f"expected {word!r}, got {self._remaining()}")
        self._take()

    def _remaining(self) -> str:
        remaining = self.text[self.begin :].strip()
        return repr(shorten(remaining)) if remaining else "the end of the line"

    def expression(self, lowest: int = 0) -> Expression:
        """Return the expression whose operators bind at least so tightly."""
        self.depth += 1
        if self.depth > _MAX_NESTING:
            raise ProgramError(f"expected at most {_MAX_NESTING} brackets in each other, got more")
        left_operand = self._operand()
        while self.kind in (1, 6) and PRECEDENCE.get(self.word, -1) > lowest:
            self._count()
            word = self._take()
            left_operand = _make_operation(word, left_operand, self.expression(PRECEDENCE[word]))
        self.depth -= 1
        return left_operand

    def _count(self) -> None:
        self.joined += 1
        if self.joined > _MAX_OPERANDS:
            raise ProgramError(
                f"expected at most {_MAX_OPERANDS} operators and components, got more"
            )

    def _operand(self) -> Expression:
        kind, word = self.kind, self.word
        if kind == 1 and word not in PRECEDENCE:
            return self._parse_name()
        if kind in (2, 3, 4, 5) or word == "{":
            return Constant(self._constant())
        if word == "(":
            self._take()
            inner = self.expression()
            self._expect(")")
            return Bracketed(inner)
        if word in ("-", "+"):
            self._take()
            operand = self.expression(PRECEDENCE["*"])
            return Negation("-", operand) if word == "-" else operand
        raise ProgramError(f"expected a value, got {self._remaining()}")

    def _parse_name(self) -> Expression:
        name = self._take()
        if name in ("TRUE", "FALSE"):
            return Constant(name == "TRUE")
        if name in ("NOT", "B_NOT"):
            return Negation(name, self.expression(PRECEDENCE["*"]))
        if self.word == "(":
            return Call(name, self._arguments())
        steps: list[str | tuple[Expression, ...]] = []
        while self.kind == 6 and self.word in (".", "["):
            self._count()
            if self._take() == ".":
                if self.kind != 1:
                    raise ProgramError(f"expected a component's name, got {self._remaining()}")
                steps.append(self._take())
            else:
                steps.append(self._indices())
        return Reference(name, tuple(steps))

    def _indices(self) -> tuple[Expression, ...]:
        indices: list[Expression] = []
        while self.word != "]":
            if self.word == ",":
                self._take()
                continue
            indices.append(self.expression())
        self._expect("]")
        return tuple(indices)

    def _arguments(self) -> tuple[Expression, ...]:
        self._expect("(")
        arguments: list[Expression] = []
        while self.word != ")":
            arguments.append(Nothing() if self.word == "," else self.expression())
            if self.word == ",":
                self._take()
            elif self.word != ")":
                raise ProgramError(f"expected ')', got {self._remaining()}")
        self._expect(")")
        return tuple(arguments)

    def _constant(self) -> Value:
        """Return a value that is written down: as all within the braces of a structure are."""
        kind = self.kind
        if kind == 6 and self.word in ("-", "+"):
            sign = -1 if self._take() == "-" else 1
            if self.kind != 2:
                raise ProgramError(f"expected a number, got {self._remaining()}")
            return sign * _bare_literal(self._take())
        if self.word == "{":
            return self._aggregate()
        word = self._take() if kind in (2, 3, 4, 5) or self.word in ("TRUE", "FALSE") else None
        if word is None:
            raise ProgramError(f"expected a number, got {self._remaining()}")
        if kind == 2:
            return _bare_literal(word)
        if kind == 3:
            return "#" + word[1:].strip().upper()
        if kind == 5:
            return _digits(word.strip("'").upper())
        return word == "TRUE" if kind == 1 else word

    def _aggregate(self) -> Aggregate:
        self.depth += 1
        if self.depth > _MAX_NESTING:
            raise ProgramError(f"expected at most {_MAX_NESTING} brackets in each other, got more")
        self._expect("{")
        fields: Aggregate = {}
        while True:
            if self.kind != 1:
                raise ProgramError(f"expected a component's name, got {self._remaining()}")
            key = self._take()
            if self.word == ":" and not fields:
                self._take()
                continue
            if self.word == "[":
                self._take()
                inner = self._indices()
                key += f"[{','.join(str(self._index(i)) for i in inner)}]"
            value = self._constant()
            fields[key] = float(value) if key in REAL_KEYS and type(value) is int else value
            if self.word == ",":
                self._take()
                continue
            self._expect("}")
            self.depth -= 1
            return fields

    def _index(self, index: Expression) -> Value:
        if not isinstance(index, Constant):
            raise ProgramError("expected numbers as indices in braces, got a name")
        return index.constant


def _make_operation(word: str, left_operand: Expression, right: Expression) -> Operation:
    """Return an operation; comparisons beside AND, OR without brackets are none.

    KRL's comparisons bind less than AND and OR, which few who write them mean.
    """
    if PRECEDENCE[word] == PRECEDENCE["=="]:
        for side in (left_operand, right):
            if isinstance(side, Operation) and PRECEDENCE[side.word] <= PRECEDENCE["AND"]:
                raise ProgramError(f"expected brackets around {word} beside {side.word}, got none")
    return Operation(word, left_operand, right)


def _bare_literal(text: str) -> float:
    try:
        return _literal(text, "")
    except ProgramError as cause:
        raise ProgramError(str(cause).removeprefix(": ")) from None


def _digits(word: str) -> int:
    base = _BASES.get(word[0], 10)
    try:
        return int(word[1:] if word[0] in _BASES else word, base)
    except ValueError as cause:
        raise ProgramError(f"expected digits of base {base}, got {shorten(word)!r}") from cause
