"""A RAPID program, executed statement by statement as far as its values are known."""

from __future__ import annotations

from collections.abc import Mapping
from contextlib import suppress
from dataclasses import dataclass, field

from coupling.errors import ProgramError
from coupling.programs.rapid_reader.calls import bound, returned
from coupling.programs.rapid_reader.effects import (
    COUNTING,
    calls_in,
    has_end,
)
from coupling.programs.rapid_reader.evaluation import Evaluation
from coupling.programs.rapid_reader.functions import RETURNING
from coupling.programs.rapid_reader.instructions import (
    LEFT_OUT,
    MOVES,
    REFUSED,
    STOPS,
    WRITING,
)
from coupling.programs.rapid_reader.memory import Frame, Memory, Variable
from coupling.programs.rapid_reader.motions import Motions
from coupling.programs.rapid_reader.moving import SETTINGS, Moving
from coupling.programs.rapid_reader.operators import operated
from coupling.programs.rapid_reader.syntax import (
    Argument,
    Assignment,
    Block,
    Call,
    Connect,
    Declaration,
    For,
    If,
    Instruction,
    Literal,
    Module,
    Return,
    Routine,
    Statement,
    Test,
    While,
    blocks_of,
)
from coupling.programs.rapid_reader.undecided import Undecided
from coupling.programs.rapid_reader.values import Data, Unknown, Value, shown
from coupling.programs.reading import ReadingNotes
from coupling.programs.text import shortened

# Statements that are executed beyond those of the text, and routines in each other, at most.
_MOST_REPEATED, _DEEPEST = 100_000, 25
_SIGNS = {"INCR": "+", "DECR": "-", "ADD": "+"}


class _Returned(Exception):  # noqa: N818 - no error
    """The end of a routine, with the value of a function."""

    def __init__(self, value: Data | None) -> None:
        self.value = value


class _Ended(Exception):  # noqa: N818 - no error
    """The end of the program."""


@dataclass
class Execution:
    """State of a controller while it goes through a program.

    Attributes:
        notes: What was left out and assumed.
        motions: Motions up to here.
    """

    notes: ReadingNotes
    memory: Memory
    motions: Motions
    _steps: int = field(default=_MOST_REPEATED)
    _depth: int = 0

    def __post_init__(self) -> None:
        self._evaluation = Evaluation(self.memory, self._function)
        self.memory.evaluate = self._evaluation.value
        self._undecided = Undecided(self.memory, self.notes)
        self._moving = Moving(self.motions, self._evaluation, self.notes)

    @classmethod
    def of(cls, modules: list[Module], others: Mapping[str, str]) -> Execution:
        """Return one at the start of a program of these modules, and of texts of other files."""
        notes = ReadingNotes()

        def unready(*_: object) -> Data:
            raise AssertionError("before there is an evaluation")

        return cls(notes, Memory(unready, modules, others, notes), Motions(notes))

    def run(self, routine: Routine, module: Module) -> None:
        """Execute a routine and what it calls.

        Raises:
            ProgramError: At the first statement that cannot be executed or left out.
        """
        self._steps += sum(
            _count(known.body)
            for holder in self.memory.modules
            for known in holder.routines.values()
        )
        with suppress(_Ended):
            self._routine(routine, Frame(module))
        self.motions.assume_zones()

    def _routine(self, routine: Routine, frame: Frame) -> Data | None:
        """Execute a routine, and return the value of a function."""
        if self._depth >= _DEEPEST:
            raise ProgramError(
                f"{routine.where}: expected at most {_DEEPEST} routines that call each other, got more"
            )
        if routine.has_handler:
            self.notes.assume("no error comes up: what stands behind ERROR and UNDO is left out")
        self._depth += 1
        try:
            self._block(routine.body, frame)
        except _Returned as end:
            return end.value
        finally:
            self._depth -= 1
        return None

    def _block(self, block: Block, frame: Frame) -> None:
        for statement in block:
            self._steps -= 1
            if self._steps < 0:
                raise ProgramError(
                    f"{statement.where}: expected at most {_MOST_REPEATED} statements in loops and"
                    " calls, got more: read a part of the program"
                )
            self._statement(statement, frame)

    def _statement(self, statement: Statement, frame: Frame) -> None:
        if isinstance(statement, Instruction):
            self._instruction(statement, frame)
        elif isinstance(statement, Assignment):
            value = self._evaluation.value(statement.value, frame, statement.where)
            self._evaluation.assign(statement.target, value, frame, statement.where)
        elif isinstance(statement, Declaration):
            frame.data[statement.name.upper()] = self.memory.declared(statement, frame)
        elif isinstance(statement, If):
            self._if(statement, frame)
        elif isinstance(statement, For):
            self._for(statement, frame)
        elif isinstance(statement, While):
            self._while(statement, frame)
        elif isinstance(statement, Test):
            self._test(statement, frame)
        elif isinstance(statement, Return):
            raise _Returned(self._returned(statement, frame))
        elif isinstance(statement, Connect):
            self._undecided.connect(statement, frame)
        else:
            raise ProgramError(
                f"{statement.where}: expected statements one after the other, got {statement.word}"
            )

    def _returned(self, statement: Return, frame: Frame) -> Data | None:
        if statement.value is None:
            return None
        return self._evaluation.value(statement.value, frame, statement.where)

    def _instruction(self, statement: Instruction, frame: Frame) -> None:
        where, arguments = statement.where, statement.arguments
        name = statement.name or self._computed_name(statement, frame)
        word = name.upper()
        if (found := self.memory.routine(word, frame)) is not None and found[0].word == "PROC":
            self._call(*found, arguments, frame, where)
        elif (form := MOVES.get(word)) is not None:
            procedure = self._moving.move(form, name, arguments, frame, where)
            if procedure:
                self._undecided.run_beside(name, procedure, frame, where)
        elif word in SETTINGS:
            self._moving.set(name, arguments, frame, where)
        elif word in STOPS:
            self._stop(STOPS[word], where)
        elif word in COUNTING:
            self._count_on(word, arguments, frame, where)
        elif word in LEFT_OUT or word in WRITING:
            self._leave_out(statement, frame)
        elif word == "CALLBYVAR":
            self._call_by_number(statement, frame)
        elif word in REFUSED:
            known, reason = REFUSED[word]
            raise ProgramError(f"{where}: expected motions to targets, got {known}, {reason}")
        else:
            raise ProgramError(
                f"{where}: expected an instruction or a procedure of the program, got"
                f" {shortened(name)}{self.memory.missing()}: put its module beside the program"
            )

    def _computed_name(self, statement: Instruction, frame: Frame) -> str:
        assert statement.computed_name is not None
        data = self._evaluation.value(statement.computed_name, frame, statement.where)
        if not isinstance(data.value, str):
            raise ProgramError(
                f"{statement.where}: expected the name of a procedure, got {shown(data.value)}"
            )
        return data.value

    def _call_by_number(self, statement: Instruction, frame: Frame) -> None:
        where = statement.where
        values = [
            self._evaluation.value(a.value, frame, where).value
            for a in statement.arguments
            if a.value is not None
        ]
        match values:
            case [str(name), float(number)]:
                self._instruction(Instruction(where, f"{name}{number:g}", ()), frame)
            case _:
                got = ", ".join(map(shown, values))
                raise ProgramError(f"{where}: expected a name and a number of CallByVar, got {got}")

    def _call(
        self,
        routine: Routine,
        module: Module,
        arguments: tuple[Argument, ...],
        frame: Frame,
        where: str,
    ) -> Data | None:
        inner = Frame(module, bound(routine, arguments, self._evaluation, frame, where))
        value = self._routine(routine, inner)
        returned(routine, arguments, inner, self._evaluation, frame, where)
        return value

    def _function(self, call: Call, frame: Frame, where: str) -> Data:
        """Return the value of a function of the program."""
        found = self.memory.routine(call.name, frame)
        assert found is not None
        self._steps -= 1
        value = self._call(*found, call.arguments, frame, where)
        if value is None:
            raise ProgramError(f"{where}: expected a value of {call.name}, got none")
        kind = found[0].kind
        return Data(
            kind, self.memory.kinds.shaped(kind, value.value, where, value.rank), value.rank
        )

    def _stop(self, word: str, where: str) -> None:
        if word not in ("EXIT", "ExitCycle"):
            place = where.rsplit(": ", 1)[-1]
            self.notes.assume(f"it ends at {word} in {place}")
        raise _Ended

    def _count_on(
        self, word: str, arguments: tuple[Argument, ...], frame: Frame, where: str
    ) -> None:
        values = [argument.value for argument in arguments if argument.value is not None]
        if len(values) != (2 if word == "ADD" else 1):
            raise ProgramError(f"{where}: expected data to count with, got {len(values)} arguments")
        target = values[0]
        new = Data("num", 0.0)
        if word != "CLEAR":
            step = Literal("num", 1.0) if word != "ADD" else values[1]
            sides = [self._evaluation.value(side, frame, where) for side in (target, step)]
            new = operated(_SIGNS[word], sides, where)
        self._evaluation.assign(target, new, frame, where)

    def _leave_out(self, statement: Instruction, frame: Frame) -> None:
        """Leave an instruction out, but for functions in it that change data."""
        word, where = statement.name.upper(), statement.where
        self.notes.leave_out(LEFT_OUT.get(word) or WRITING[word])
        for call in calls_in(statement):
            if self.memory.routine(call.name, frame) is not None:
                self._function(call, frame, where)
        for argument in statement.arguments:
            if word in WRITING or argument.option in RETURNING:
                self._evaluation.forget(argument, statement.name, frame, where)

    def _if(self, statement: If, frame: Frame) -> None:
        for at, (condition, block) in enumerate(statement.branches):
            if condition is None:
                self._block(block, frame)
                return
            value = self._evaluation.value(condition, frame, statement.where).value
            if isinstance(value, Unknown):
                rest = tuple(item for _, inner in statement.branches[at:] for item in inner)
                self._leave("IF", rest, frame, statement.where, value)
                return
            if _truth(value, statement.where):
                self._block(block, frame)
                return

    def _while(self, statement: While, frame: Frame) -> None:
        where, body = statement.where, statement.body
        while True:
            value = self._evaluation.value(statement.condition, frame, where).value
            if isinstance(value, Unknown):
                self._leave("WHILE", body, frame, where, value)
                return
            if not _truth(value, where):
                return
            if isinstance(statement.condition, Literal) and not has_end(body, self.memory, frame):
                raise ProgramError(
                    f"{where}: expected a loop that ends, got WHILE TRUE: read what stands in it, as a"
                    " procedure without the loop"
                )
            self._block(body, frame)
            self._steps -= 1
            if self._steps < 0:
                raise ProgramError(
                    f"{where}: expected a loop of at most {_MOST_REPEATED} statements, got WHILE that"
                    " does not end"
                )

    def _for(self, statement: For, frame: Frame) -> None:
        where = statement.where
        bounds = [statement.first, statement.last]
        if statement.step is not None:
            bounds.append(statement.step)
        values = [self._evaluation.value(bound, frame, where).value for bound in bounds]
        for value in values:
            if isinstance(value, Unknown):
                self._leave("FOR", statement.body, frame, where, value)
                return
        numbers = [
            self._evaluation.number(bound, "a bound of FOR", frame, where) for bound in bounds
        ]
        first, last = numbers[:2]
        step = numbers[2] if len(numbers) > 2 else (1.0 if first <= last else -1.0)
        if step == 0.0:
            raise ProgramError(f"{where}: expected a step of FOR, got 0")
        key = statement.name.upper()
        hidden = frame.data.get(key)
        count = 0
        while (first + count * step - last) * step <= 0.0:
            frame.data[key] = Variable(Data("num", first + count * step))
            self._block(statement.body, frame)
            count += 1
            self._steps -= 1
            if self._steps < 0:
                raise ProgramError(
                    f"{where}: expected a loop of at most {_MOST_REPEATED} statements, got FOR from"
                    f" {first:g} to {last:g}"
                )
        frame.data.pop(key, None)
        if hidden is not None:
            frame.data[key] = hidden

    def _leave(self, word: str, block: Block, frame: Frame, where: str, cause: Unknown) -> None:
        self._steps -= _count(block)
        self._undecided.leave(word, block, frame, where, cause)

    def _test(self, statement: Test, frame: Frame) -> None:
        where = statement.where
        value = self._evaluation.value(statement.value, frame, where)
        for at, (wanted, block) in enumerate(statement.cases):
            for item in wanted or ():
                sides = [value, self._evaluation.value(item, frame, where)]
                equal = operated("=", sides, where).value
                if isinstance(equal, Unknown):
                    rest = tuple(part for _, inner in statement.cases[at:] for part in inner)
                    self._leave("TEST", rest, frame, where, equal)
                    return
                if equal:
                    self._block(block, frame)
                    return
            if wanted is None:
                self._block(block, frame)
                return


def _truth(value: Value, where: str) -> bool:
    if not isinstance(value, bool):
        raise ProgramError(f"{where}: expected a condition, got {shown(value)}")
    return value


def _count(block: Block) -> int:
    return len(block) + sum(_count(inner) for item in block for inner in blocks_of(item))
