"""A RAPID program, executed statement by statement as far as its values are known."""

from __future__ import annotations

from collections.abc import Mapping
from contextlib import suppress
from dataclasses import dataclass, field

from coupling.errors import ProgramError
from coupling.programs.budget import Budget
from coupling.programs.endless import ProgramEnd, end_after_pass
from coupling.programs.rapid.calls import bind_arguments
from coupling.programs.rapid.effects import (
    COUNTING,
    calls_in,
    has_end,
)
from coupling.programs.rapid.evaluation import RapidEvaluation
from coupling.programs.rapid.functions import RETURNING
from coupling.programs.rapid.instruction_classes import (
    LEFT_OUT,
    MOVES,
    REFUSED,
    SIGNAL_WAITS,
    STOPS,
    WRITING,
)
from coupling.programs.rapid.memory import RapidMemory, RapidVariable, RoutineScope
from coupling.programs.rapid.motion_statements import SETTINGS, Moving
from coupling.programs.rapid.motions import RapidMotions
from coupling.programs.rapid.operators import apply_operator
from coupling.programs.rapid.syntax import (
    Argument,
    Assignment,
    Block,
    Connect,
    DataDeclaration,
    For,
    FunctionCall,
    If,
    Literal,
    RapidInstruction,
    RapidModule,
    RapidRoutine,
    Return,
    Statement,
    Test,
    While,
    count_statements,
)
from coupling.programs.rapid.undecided import Undecided
from coupling.programs.rapid.values import Data, format_value, require_truth
from coupling.programs.reading import ReadingNotes
from coupling.programs.text import shorten
from coupling.programs.unknown import Unknown

# Routines in each other, at most.
_MAX_CALL_DEPTH = 25
_SIGNS = {"INCR": "+", "DECR": "-", "ADD": "+"}


class _Returned(Exception):  # noqa: N818 - no error
    """The end of a routine, with the value of a function."""

    def __init__(self, value: Data | None) -> None:
        self.value = value


@dataclass
class RapidExecution:
    """State of a controller while it goes through a program.

    Attributes:
        notes: Statements left out, and assumptions.
        motions: Motions up to here.
    """

    notes: ReadingNotes
    memory: RapidMemory
    motions: RapidMotions
    _budget: Budget = field(default_factory=Budget)
    _depth: int = 0

    def __post_init__(self) -> None:
        self._evaluation = RapidEvaluation(self.memory, self._function)
        self.memory.evaluate = self._evaluation.value
        self._undecided = Undecided(self.memory, self.notes)
        self._moving = Moving(self.motions, self._evaluation, self.notes)

    @classmethod
    def of(cls, modules: list[RapidModule], others: Mapping[str, str]) -> RapidExecution:
        """Return one at the start of a program of these modules, and of texts of other files."""
        notes = ReadingNotes()

        def unready(*_: object) -> Data:
            raise AssertionError("before there is an evaluation")

        return cls(notes, RapidMemory(unready, modules, others, notes), RapidMotions(notes))

    def run(self, routine: RapidRoutine, module: RapidModule) -> None:
        """Execute a routine and what it calls.

        Raises:
            ProgramError: At the first statement that cannot be executed or left out.
        """
        self._budget.remaining += sum(
            count_statements(candidate.body)
            for holder in self.memory.modules
            for candidate in holder.routines.values()
        )
        with suppress(ProgramEnd):
            self._routine(routine, RoutineScope(module))
        self.motions.assume_zones()

    def _routine(self, routine: RapidRoutine, scope: RoutineScope) -> Data | None:
        """Execute a routine, and return the value of a function."""
        if self._depth >= _MAX_CALL_DEPTH:
            raise ProgramError(
                f"{routine.where}: expected at most {_MAX_CALL_DEPTH} routines that call each other,"
                " got more"
            )
        if routine.has_handler:
            self.notes.assume("no error comes up: what stands behind ERROR and UNDO is left out")
        self._depth += 1
        try:
            self._block(routine.body, scope)
        except _Returned as end:
            return end.value
        finally:
            self._depth -= 1
        return None

    def _block(self, block: Block, scope: RoutineScope) -> None:
        for statement in block:
            self._budget.spend(statement.where)
            self._statement(statement, scope)

    def _statement(self, statement: Statement, scope: RoutineScope) -> None:
        if isinstance(statement, RapidInstruction):
            self._instruction(statement, scope)
        elif isinstance(statement, Assignment):
            value = self._evaluation.value(statement.value, scope, statement.where)
            self._evaluation.assign(statement.target, value, scope, statement.where)
        elif isinstance(statement, DataDeclaration):
            scope.data[statement.name.upper()] = self.memory.declared(statement, scope)
        elif isinstance(statement, If):
            self._if(statement, scope)
        elif isinstance(statement, For):
            self._for(statement, scope)
        elif isinstance(statement, While):
            self._while(statement, scope)
        elif isinstance(statement, Test):
            self._test(statement, scope)
        elif isinstance(statement, Return):
            raise _Returned(self._return_value(statement, scope))
        elif isinstance(statement, Connect):
            self._undecided.connect(statement, scope)
        else:
            raise ProgramError(
                f"{statement.where}: expected statements one after the other, got {statement.word}"
            )

    def _return_value(self, statement: Return, scope: RoutineScope) -> Data | None:
        if statement.value is None:
            return None
        return self._evaluation.value(statement.value, scope, statement.where)

    def _instruction(self, statement: RapidInstruction, scope: RoutineScope) -> None:
        where, arguments = statement.where, statement.arguments
        name = statement.name or self._computed_name(statement, scope)
        word = name.upper()
        if (routine := self.memory.routine(word, scope)) is not None and routine[0].word == "PROC":
            self._call(*routine, arguments, scope, where)
        elif (form := MOVES.get(word)) is not None:
            self._moving.move(form, name, arguments, scope, where)
        elif word in SETTINGS:
            self._moving.set(name, arguments, scope, where)
        elif word in STOPS:
            self._stop(STOPS[word], where)
        elif word in COUNTING:
            self._count_on(word, arguments, scope, where)
        elif word in LEFT_OUT or word in WRITING:
            self._leave_out(statement, scope)
        elif word in REFUSED:
            instruction, reason = REFUSED[word]
            raise ProgramError(f"{where}: expected motions to targets, got {instruction}, {reason}")
        else:
            raise ProgramError(
                f"{where}: expected an instruction or a procedure of the program, got"
                f" {shorten(name)}{self.memory.missing()}: put its module beside the program"
            )

    def _computed_name(self, statement: RapidInstruction, scope: RoutineScope) -> str:
        assert statement.computed_name is not None
        data = self._evaluation.value(statement.computed_name, scope, statement.where)
        if not isinstance(data.value, str):
            raise ProgramError(
                f"{statement.where}: expected the name of a procedure, got {format_value(data.value)}"
            )
        return data.value

    def _call(
        self,
        routine: RapidRoutine,
        module: RapidModule,
        arguments: tuple[Argument, ...],
        scope: RoutineScope,
        where: str,
    ) -> Data | None:
        inner = RoutineScope(
            module, bind_arguments(routine, arguments, self._evaluation, scope, where)
        )
        return self._routine(routine, inner)

    def _function(self, call: FunctionCall, scope: RoutineScope, where: str) -> Data:
        """Return the value of a function of the program."""
        routine = self.memory.routine(call.name, scope)
        assert routine is not None
        self._budget.spend(where)
        value = self._call(*routine, call.arguments, scope, where)
        if value is None:
            raise ProgramError(f"{where}: expected a value of {call.name}, got none")
        kind = routine[0].kind
        return Data(
            kind, self.memory.kinds.shaped(kind, value.value, where, value.rank), value.rank
        )

    def _stop(self, word: str, where: str) -> None:
        if word not in ("EXIT", "ExitCycle"):
            place = where.rsplit(": ", 1)[-1]
            self.notes.assume(f"it ends at {word} in {place}")
        raise ProgramEnd

    def _count_on(
        self, word: str, arguments: tuple[Argument, ...], scope: RoutineScope, where: str
    ) -> None:
        values = [argument.value for argument in arguments if argument.value is not None]
        if len(values) != (2 if word == "ADD" else 1):
            raise ProgramError(f"{where}: expected data to count with, got {len(values)} arguments")
        target = values[0]
        new = Data("num", 0.0)
        if word != "CLEAR":
            step = Literal("num", 1.0) if word != "ADD" else values[1]
            sides = [self._evaluation.value(side, scope, where) for side in (target, step)]
            new = apply_operator(_SIGNS[word], sides, where)
        self._evaluation.assign(target, new, scope, where)

    def _leave_out(self, statement: RapidInstruction, scope: RoutineScope) -> None:
        """Leave an instruction out, but for functions in it that change data."""
        word, where = statement.name.upper(), statement.where
        self.notes.leave_out(LEFT_OUT.get(word) or WRITING[word])
        moves = self.motions.moves
        if word in SIGNAL_WAITS and moves and not moves[-1].is_stop:
            self.notes.assume(
                "signals that it waits for behind zones come in time: the tool does not stand there"
            )
        for call in calls_in(statement):
            if self.memory.routine(call.name, scope) is not None:
                self._function(call, scope, where)
        for argument in statement.arguments:
            if word in WRITING or argument.option in RETURNING:
                self._evaluation.forget(argument, statement.name, scope, where)

    def _if(self, statement: If, scope: RoutineScope) -> None:
        for at, (condition, block) in enumerate(statement.branches):
            if condition is None:
                self._block(block, scope)
                return
            value = self._evaluation.value(condition, scope, statement.where).value
            if isinstance(value, Unknown):
                further_statements = tuple(
                    item for _, inner in statement.branches[at:] for item in inner
                )
                self._leave("IF", further_statements, scope, statement.where, value)
                return
            if require_truth(value, statement.where):
                self._block(block, scope)
                return

    def _while(self, statement: While, scope: RoutineScope) -> None:
        where, body = statement.where, statement.body
        while True:
            value = self._evaluation.value(statement.condition, scope, where).value
            if isinstance(value, Unknown):
                self._leave("WHILE", body, scope, where, value)
                return
            if not require_truth(value, where):
                return
            begin = len(self.motions.moves)
            self._block(body, scope)
            if isinstance(statement.condition, Literal) and not has_end(body, self.memory, scope):
                end_after_pass(
                    begin,
                    self.motions.moves,
                    lambda: self._block(body, scope),
                    self.notes,
                    where,
                )
            self._budget.spend(where)

    def _for(self, statement: For, scope: RoutineScope) -> None:
        where = statement.where
        bounds = [statement.first, statement.last]
        if statement.step is not None:
            bounds.append(statement.step)
        values = [self._evaluation.value(bound, scope, where).value for bound in bounds]
        for value in values:
            if isinstance(value, Unknown):
                self._leave("FOR", statement.body, scope, where, value)
                return
        numbers = [
            self._evaluation.number(bound, "a bound of FOR", scope, where) for bound in bounds
        ]
        first, last = numbers[:2]
        step = numbers[2] if len(numbers) > 2 else (1.0 if first <= last else -1.0)
        if step == 0.0:
            raise ProgramError(f"{where}: expected a step of FOR, got 0")
        key = statement.name.upper()
        hidden = scope.data.get(key)
        count = 0
        while (first + count * step - last) * step <= 0.0:
            scope.data[key] = RapidVariable(Data("num", first + count * step))
            self._block(statement.body, scope)
            count += 1
            self._budget.spend(where)
        scope.data.pop(key, None)
        if hidden is not None:
            scope.data[key] = hidden

    def _leave(
        self, word: str, block: Block, scope: RoutineScope, where: str, cause: Unknown
    ) -> None:
        self._budget.spend(where, count_statements(block))
        self._undecided.leave(word, block, scope, where, cause)

    def _test(self, statement: Test, scope: RoutineScope) -> None:
        where = statement.where
        value = self._evaluation.value(statement.value, scope, where)
        for at, (values, block) in enumerate(statement.cases):
            for item in values or ():
                sides = [value, self._evaluation.value(item, scope, where)]
                equal = apply_operator("=", sides, where).value
                if isinstance(equal, Unknown):
                    further_statements = tuple(
                        part for _, inner in statement.cases[at:] for part in inner
                    )
                    self._leave("TEST", further_statements, scope, where, equal)
                    return
                if equal:
                    self._block(block, scope)
                    return
            if values is None:
                self._block(block, scope)
                return
