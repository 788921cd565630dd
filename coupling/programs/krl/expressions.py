"""Expressions of KRL: what they stand for."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Protocol

from coupling.errors import ProgramError
from coupling.programs.krl.operators import apply_binary, apply_unary
from coupling.programs.krl.values import UnknownValueError, Value, copy_value


class Scope(Protocol):
    """What expressions ask of the place where they stand.

    Attributes:
        where: Place in the program, for messages.
    """

    where: str

    def value(self, reference: Reference) -> Value:
        """Return the value of a variable; UnknownValueError where there is none."""

    def result(self, name: str, arguments: Sequence[Expression]) -> Value:
        """Return the result of a function."""


class Expression(Protocol):
    """A part of a statement that has a value."""

    def evaluate(self, scope: Scope) -> Value:
        """Return the value."""


@dataclass(frozen=True)
class Constant:
    """A value that is written down."""

    constant: Value

    def evaluate(self, scope: Scope) -> Value:
        """Return the value."""
        return copy_value(self.constant)


@dataclass(frozen=True)
class Reference:
    """A variable, an element of an array, a component of a structure.

    Attributes:
        name: Name in upper case.
        steps: Components by name, elements by their indices.
    """

    name: str
    steps: tuple[str | tuple[Expression, ...], ...] = ()

    def evaluate(self, scope: Scope) -> Value:
        """Return the value."""
        return scope.value(self)


@dataclass(frozen=True)
class Operation:
    """Two values and what joins them."""

    word: str
    left_operand: Expression
    right: Expression

    def evaluate(self, scope: Scope) -> Value:
        """Return the value."""
        try:
            left_value = self.left_operand.evaluate(scope)
        except UnknownValueError:
            self.right.evaluate(scope)  # for the routines that it calls
            raise
        return apply_binary(self.word, left_value, self.right.evaluate(scope), scope.where)


@dataclass(frozen=True)
class Negation:
    """A minus or NOT before a value."""

    word: str
    operand: Expression

    def evaluate(self, scope: Scope) -> Value:
        """Return the value."""
        return apply_unary(self.word, self.operand.evaluate(scope), scope.where)


@dataclass(frozen=True)
class Call:
    """A function or a routine with its arguments."""

    name: str
    arguments: tuple[Expression, ...]

    def evaluate(self, scope: Scope) -> Value:
        """Return the value."""
        return scope.result(self.name, self.arguments)


@dataclass(frozen=True)
class Nothing:
    """An argument that is left empty."""

    def evaluate(self, scope: Scope) -> Value:
        """Return the value."""
        raise ProgramError(f"{scope.where}: expected a value, got an empty argument")


@dataclass(frozen=True)
class Bracketed:
    """An expression in brackets, which joins with what stands around them as one value."""

    inner: Expression

    def evaluate(self, scope: Scope) -> Value:
        """Return the value."""
        return self.inner.evaluate(scope)
