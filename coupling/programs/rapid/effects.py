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
    Connect,
    DataDeclaration,
    Expression,
    For,
    FunctionCall,
    Jump,
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
    search = _EffectSearch(memory)
    search.add(block, scope, is_called=False)
    return search.effects


def effects_of_routine(routine: RapidRoutine, memory: RapidMemory, scope: RoutineScope) -> Effects:
    """Return what a routine can do, wherever it is called."""
    search = _EffectSearch(memory)
    search.enter(routine, scope)
    return search.effects


@dataclass
class _EffectSearch:
    """Looks through statements and the routines that they call, each once."""

    memory: RapidMemory
    effects: Effects = field(default_factory=Effects)
    _visited: set[int] = field(default_factory=set)

    def add(self, block: Block, scope: RoutineScope, is_called: bool) -> None:
        """Add what statements can do."""
        for statement in block:
            self._add_statement(statement, scope, is_called)
            for inner in blocks_of(statement):
                self.add(inner, scope, is_called)

    def enter(self, routine: RapidRoutine, scope: RoutineScope) -> None:
        """Add what a routine can do; its parameters and data are its own."""
        if id(routine) in self._visited:
            return
        self._visited.add(id(routine))
        inner = [item for item in statements_in(routine.body) if isinstance(item, DataDeclaration)]
        for name in (*(item.name for item in inner), *(item.name for item in routine.parameters)):
            scope.data[name.upper()] = RapidVariable(_UNKNOWN_DATA)
        for item in statements_in(routine.body):
            if isinstance(item, For):
                scope.data[item.name.upper()] = RapidVariable(_UNKNOWN_DATA)
        self.add(routine.body, scope, is_called=True)

    def _add_statement(self, statement: Statement, scope: RoutineScope, is_called: bool) -> None:
        blocker = ""
        if isinstance(statement, Assignment):
            self._change(statement.target, scope)
        elif isinstance(statement, Jump):
            blocker = statement.word
        elif isinstance(statement, Return) and not is_called:
            blocker = "RETURN"
        elif isinstance(statement, Connect):
            blocker = "CONNECT"
        elif isinstance(statement, RapidInstruction):
            blocker = self._add_instruction(statement, scope)
        for call in calls_in(statement):
            routine = self.memory.routine(call.name, scope)
            if routine is not None:
                self.enter(routine[0], RoutineScope(routine[1]))
            writes = routine is not None or call.name.upper() in WRITING_FUNCTIONS
            for argument in call.arguments:
                if writes or argument.option in RETURNING:
                    self._change(argument.value, scope)
        if blocker and not self.effects.blocker:
            self.effects.blocker = f"{blocker} in {statement.where.split(': ', 1)[-1]}"

    def _add_instruction(self, statement: RapidInstruction, scope: RoutineScope) -> str:
        """Add what an instruction can do, and return its name if it may change the path."""
        word = statement.name.upper()
        if word and (routine := self.memory.routine(word, scope)) is not None:
            for argument in statement.arguments:
                self._change(argument.value, scope)
            self.enter(routine[0], RoutineScope(routine[1]))
        elif word in STOPS:
            self.effects.stops.append(STOPS[word])
        elif word in COUNTING or word in LEFT_OUT or word in WRITING:
            for argument in statement.arguments:
                if word not in LEFT_OUT or argument.option in RETURNING:
                    self._change(argument.value, scope)
        else:
            return statement.name or "a call of what a text names"
        return ""

    def _change(self, target: Expression | None, scope: RoutineScope) -> None:
        if (variable := self.memory.changeable(target, scope)) is not None:
            self.effects.changed.append(variable)


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
