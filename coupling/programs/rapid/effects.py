"""What statements can do that are not executed: behind an open condition, or in an interrupt."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, field, fields, is_dataclass

from coupling.programs.rapid.functions import RETURNING
from coupling.programs.rapid.functions import WRITING as WRITING_FUNCTIONS
from coupling.programs.rapid.instruction_classes import LEFT_OUT, STOPS, WRITING
from coupling.programs.rapid.memory import RapidMemory, RapidVariable, RoutineScope
from coupling.programs.rapid.syntax import (
    Assignment,
    Block,
    Component,
    Connect,
    DataDeclaration,
    Element,
    Expression,
    For,
    FunctionCall,
    Jump,
    Name,
    RapidInstruction,
    RapidRoutine,
    Return,
    Statement,
    blocks_of,
    statements_in,
)
from coupling.programs.rapid.values import Data
from coupling.programs.unknown import Unknown

_UNKNOWN_DATA = Data("", Unknown("data of a routine that is not executed"))
# Instructions that give their first argument another value.
COUNTING = frozenset(["INCR", "DECR", "ADD", "CLEAR"])


@dataclass
class Effects:
    """Effects of statements.

    Attributes:
        changed: Data that they may give other values.
        stops: Instructions among them that end the program.
        blocker: Place and word of the first statement that may change the path; empty if none.
    """

    changed: list[RapidVariable] = field(default_factory=list)
    stops: list[str] = field(default_factory=list)
    blocker: str = ""


def effects_of(block: Block, memory: RapidMemory, scope: RoutineScope) -> Effects:
    """Return what statements can do, and the routines that they call."""
    effects = Effects()
    _add(block, memory, scope, effects, set(), False)
    return effects


def effects_of_routine(routine: RapidRoutine, memory: RapidMemory, scope: RoutineScope) -> Effects:
    """Return what a routine can do, wherever it is called."""
    effects = Effects()
    _enter(routine, scope, memory, effects, set())
    return effects


def _add(
    block: Block,
    memory: RapidMemory,
    scope: RoutineScope,
    effects: Effects,
    visited: set[int],
    is_called: bool,
) -> None:
    for statement in block:
        _add_statement(statement, memory, scope, effects, visited, is_called)
        for inner in blocks_of(statement):
            _add(inner, memory, scope, effects, visited, is_called)


def _add_statement(
    statement: Statement,
    memory: RapidMemory,
    scope: RoutineScope,
    effects: Effects,
    visited: set[int],
    is_called: bool,
) -> None:
    blocker = ""
    if isinstance(statement, Assignment):
        _change(statement.target, memory, scope, effects)
    elif isinstance(statement, Jump):
        blocker = statement.word
    elif isinstance(statement, Return) and not is_called:
        blocker = "RETURN"
    elif isinstance(statement, Connect):
        blocker = "CONNECT"
    elif isinstance(statement, RapidInstruction):
        blocker = _add_instruction(statement, memory, scope, effects, visited)
    for call in calls_in(statement):
        if (routine := memory.routine(call.name, scope)) is not None:
            _enter(routine[0], RoutineScope(routine[1]), memory, effects, visited)
            for argument in call.arguments:
                _change(argument.value, memory, scope, effects)
        for argument in call.arguments:
            if call.name.upper() in WRITING_FUNCTIONS or argument.option in RETURNING:
                _change(argument.value, memory, scope, effects)
    if blocker and not effects.blocker:
        effects.blocker = f"{blocker} in {statement.where.split(': ', 1)[-1]}"


def _add_instruction(
    statement: RapidInstruction,
    memory: RapidMemory,
    scope: RoutineScope,
    effects: Effects,
    visited: set[int],
) -> str:
    """Add what an instruction can do, and return its name if it may change the path."""
    word = statement.name.upper()
    if word and (routine := memory.routine(word, scope)) is not None:
        for argument in statement.arguments:
            _change(argument.value, memory, scope, effects)
        _enter(routine[0], RoutineScope(routine[1]), memory, effects, visited)
    elif word in STOPS:
        effects.stops.append(STOPS[word])
    elif word in COUNTING or word in LEFT_OUT or word in WRITING:
        for argument in statement.arguments:
            if word not in LEFT_OUT or argument.option in RETURNING:
                _change(argument.value, memory, scope, effects)
    else:
        return statement.name or "a call of what a text names"
    return ""


def _enter(
    routine: RapidRoutine,
    scope: RoutineScope,
    memory: RapidMemory,
    effects: Effects,
    visited: set[int],
) -> None:
    """Add what a routine can do; its parameters and data are its own."""
    if id(routine) in visited:
        return
    visited.add(id(routine))
    inner = [item for item in statements_in(routine.body) if isinstance(item, DataDeclaration)]
    for name in (*(item.name for item in inner), *(item.name for item in routine.parameters)):
        scope.data[name.upper()] = RapidVariable(_UNKNOWN_DATA)
    for item in statements_in(routine.body):
        if isinstance(item, For):
            scope.data[item.name.upper()] = RapidVariable(_UNKNOWN_DATA)
    _add(routine.body, memory, scope, effects, visited, True)


def _change(
    target: Expression | None, memory: RapidMemory, scope: RoutineScope, effects: Effects
) -> None:
    while isinstance(target, Component | Element):
        target = target.record if isinstance(target, Component) else target.array
    if isinstance(target, Name):
        variable = memory.variable(target.name, scope)
        if variable is None:
            variable = memory.undeclared(target.name)
        if variable.storage != "CONST":
            effects.changed.append(variable)


def calls_in(part: object) -> Iterator[FunctionCall]:
    """Yield the functions that a statement's expressions call, but not those of statements in it."""
    if isinstance(part, FunctionCall):
        yield part
    if isinstance(part, tuple):
        for item in part:
            if not isinstance(item, Statement):
                yield from calls_in(item)
    elif is_dataclass(part) and not isinstance(part, type):
        for item in fields(part):
            yield from calls_in(getattr(part, item.name))


def has_end(block: Block, memory: RapidMemory, scope: RoutineScope) -> bool:
    """Return whether statements can end a loop around them."""
    visited: set[int] = set()

    def ends(block: Block, scope: RoutineScope, is_called: bool) -> bool:
        for statement in statements_in(block):
            if isinstance(statement, Jump) or (isinstance(statement, Return) and not is_called):
                return True
            if not isinstance(statement, RapidInstruction):
                continue
            if statement.name.upper() in STOPS or statement.computed_name is not None:
                return True
            routine = memory.routine(statement.name, scope)
            if routine is not None and id(routine[0]) not in visited:
                visited.add(id(routine[0]))
                if ends(routine[0].body, RoutineScope(routine[1]), True):
                    return True
        return False

    return ends(block, scope, False)
