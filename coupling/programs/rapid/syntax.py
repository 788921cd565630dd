"""Parts of RAPID text: expressions, statements, routines and modules."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, field

from coupling.programs.rapid.values import Value


@dataclass(frozen=True, slots=True)
class Literal:
    """A number, text, truth value, or brackets of such.

    Attributes:
        kind: Kind of the value; empty for brackets, whose kind their use tells.
    """

    kind: str
    value: Value


@dataclass(frozen=True, slots=True)
class Brackets:
    """Values in brackets that are not all literal."""

    items: tuple[Expression, ...]


@dataclass(frozen=True, slots=True)
class Name:
    """Data by its name, in the letters of the text."""

    name: str


@dataclass(frozen=True, slots=True)
class Component:
    """A component of a record."""

    record: Expression
    name: str


@dataclass(frozen=True, slots=True)
class Element:
    """An element of an array."""

    array: Expression
    indices: tuple[Expression, ...]


@dataclass(frozen=True, slots=True)
class Argument:
    r"""An argument of a routine.

    Attributes:
        option: Name behind a backslash, upper case; empty for one that stands in its place.
        value: None for an option that is a switch.
        is_conditional: Whether it stands only where the option of another routine does, `\T?Time`.
    """

    option: str
    value: Expression | None
    is_conditional: bool = False


@dataclass(frozen=True, slots=True)
class FunctionCall:
    """A function with its arguments."""

    name: str
    arguments: tuple[Argument, ...]


@dataclass(frozen=True, slots=True)
class OperatorExpression:
    """An operator with its one or two operands."""

    operator: str
    operands: tuple[Expression, ...]


Expression = Literal | Brackets | Name | Component | Element | FunctionCall | OperatorExpression


@dataclass(frozen=True, slots=True)
class DataDeclaration:
    """Data with a kind, in capitals neither.

    Attributes:
        storage: CONST, PERS or VAR.
        extents: Sizes of an array.
    """

    where: str
    storage: str
    kind: str
    name: str
    extents: tuple[Expression, ...]
    initial: Expression | None
    is_local: bool


@dataclass(frozen=True, slots=True)
class Assignment:
    """Data, or a part of them, get a value."""

    where: str
    target: Expression
    value: Expression


@dataclass(frozen=True, slots=True)
class RapidInstruction:
    """A procedure by its name, or by a text between percent signs."""

    where: str
    name: str
    arguments: tuple[Argument, ...]
    computed_name: Expression | None = None


@dataclass(frozen=True, slots=True)
class If:
    """Conditions with their statements; those behind ELSE have None."""

    where: str
    branches: tuple[tuple[Expression | None, Block], ...]


@dataclass(frozen=True, slots=True)
class For:
    """A loop that counts."""

    where: str
    name: str
    first: Expression
    last: Expression
    step: Expression | None
    body: Block


@dataclass(frozen=True, slots=True)
class While:
    """A loop with a condition."""

    where: str
    condition: Expression
    body: Block


@dataclass(frozen=True, slots=True)
class Test:
    """A value and the cases with their statements; those behind DEFAULT have None."""

    where: str
    value: Expression
    cases: tuple[tuple[tuple[Expression, ...] | None, Block], ...]


@dataclass(frozen=True, slots=True)
class Return:
    """The end of a routine."""

    where: str
    value: Expression | None


@dataclass(frozen=True, slots=True)
class Connect:
    """An interrupt and its routine."""

    where: str
    trap: str


@dataclass(frozen=True, slots=True)
class Jump:
    """GOTO, RAISE, RETRY or TRYNEXT."""

    where: str
    word: str


Statement = (
    DataDeclaration
    | Assignment
    | RapidInstruction
    | If
    | For
    | While
    | Test
    | Return
    | Connect
    | Jump
)
Block = tuple[Statement, ...]


@dataclass(frozen=True, slots=True)
class Parameter:
    """A parameter of a routine.

    Attributes:
        kind: Kind of its data, or switch.
        is_reference: Whether the routine may change what is given.
    """

    name: str
    kind: str
    is_optional: bool
    is_reference: bool
    rank: int


@dataclass(frozen=True)
class RapidRoutine:
    """A procedure, function or trap.

    Attributes:
        word: PROC, FUNC or TRAP.
        kind: Kind of a function's value.
        has_handler: Whether it has statements for errors.
    """

    where: str
    word: str
    name: str
    kind: str
    parameters: tuple[Parameter, ...]
    body: Block
    has_handler: bool
    is_local: bool


@dataclass
class RapidModule:
    """Data and routines of a module, by names in capitals.

    Attributes:
        file: Name of its file.
        records: Components of the records that it defines, by name in small letters.
    """

    file: str
    data: dict[str, DataDeclaration] = field(default_factory=dict)
    routines: dict[str, RapidRoutine] = field(default_factory=dict)
    records: dict[str, tuple[tuple[str, str], ...]] = field(default_factory=dict)


def blocks_of(statement: Statement) -> Iterator[Block]:
    """Yield the statements that a statement holds."""
    if isinstance(statement, If):
        yield from (block for _, block in statement.branches)
    elif isinstance(statement, For | While):
        yield statement.body
    elif isinstance(statement, Test):
        yield from (block for _, block in statement.cases)


def statements_in(block: Block) -> Iterator[Statement]:
    """Yield statements and those that they hold."""
    for statement in block:
        yield statement
        for inner in blocks_of(statement):
            yield from statements_in(inner)


def count_statements(block: Block) -> int:
    """Return the number of statements of a block, and of those in them."""
    return len(block) + sum(count_statements(inner) for item in block for inner in blocks_of(item))
