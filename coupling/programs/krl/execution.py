"""Execution of a KRL program: blocks, assignments and calls."""

from __future__ import annotations

import re
from collections.abc import Callable, Sequence
from dataclasses import dataclass, field

from coupling.errors import ProgramError
from coupling.programs.budget import Budget
from coupling.programs.endless import ProgramEnd
from coupling.programs.krl.assignments import Assignments
from coupling.programs.krl.blocks import Blocks, LoopExit
from coupling.programs.krl.controller import KrlController
from coupling.programs.krl.expressions import Call, Expression, Reference
from coupling.programs.krl.harmless import harmless_word, is_harmless_call, require_no_call
from coupling.programs.krl.interrupts import Interrupts
from coupling.programs.krl.memory import Names
from coupling.programs.krl.motion_statements import MotionStatements
from coupling.programs.krl.parser import leading, parse_expression
from coupling.programs.krl.syntax import KrlLine, Routine, Statement
from coupling.programs.krl.values import UnknownValueError, Value
from coupling.programs.program import ProgramFile
from coupling.programs.text import shorten
from coupling.programs.unknown import Unknown

# Routines that call each other, at most.
_MAX_CALL_DEPTH = 30
# At these the robot comes to rest, for nothing behind them is planned; not behind CONTINUE.
_STOPPING = frozenset(("WAIT", "HALT", "PULSE", "ANOUT", "$OUT", "$ANOUT"))
_LABEL = re.compile(r"[A-Za-z_]\w*\s*:")
_REFUSED = {
    "GOTO": "write IF and loops",
    "RESUME": "read the program without interrupts",
}


class _ReturnError(Exception):
    """RETURN leaves a routine, with a value."""

    def __init__(self, value: Value | None) -> None:
        super().__init__()
        self.value = value


@dataclass
class Interpreter:
    """Runs routines on a controller.

    Attributes:
        controller: Its state.
        routines: All routines of the files at hand.
        motions: Statements that move.
    """

    controller: KrlController
    routines: Sequence[Routine]
    motions: MotionStatements = field(init=False)
    _interrupts: Interrupts = field(init=False)
    _assignments: Assignments = field(init=False)
    _blocks: Blocks = field(init=False)
    _module: str = ""
    _depth: int = 0
    _continued: int = 0
    _budget: Budget = field(default_factory=Budget)
    _names: dict[tuple[str, str], Routine] = field(default_factory=dict)

    def __post_init__(self) -> None:
        for routine in self.routines:
            name = routine.name.upper()
            self._names.setdefault((routine.module, name), routine)
            if routine.is_global:
                self._names.setdefault(("", name), routine)
        self._budget.remaining += sum(len(routine.lines) for routine in self.routines)
        self.controller.call = self._run_function
        self.motions = MotionStatements(self.controller)
        self._assignments = Assignments(self.controller)
        self._interrupts = Interrupts(self.controller, self._routine)
        self._blocks = Blocks(
            self.controller, self.motions.motions, self._execute, self._count, self._routine
        )
        self._executed: dict[str, Callable[[KrlLine], None]] = {
            **self.motions.executed,
            "INTERRUPT": self._interrupts.take,
            "TRIGGER": self._interrupts.trigger,
            "EXIT": self._exit,
            "RETURN": self._return,
        }

    def load(self, file: ProgramFile, *, is_called: bool) -> None:
        """Take the data of a .dat over, of a module that is called or another.  Raises as `run`."""
        self._assignments.load(file, is_called=is_called)

    def run(self, routine: Routine) -> None:
        """Run the routine that a user starts.

        Raises:
            ProgramError: With the line, what was expected and what was got.
        """
        try:
            self._run(routine, [])
        except UnknownValueError as cause:
            raise ProgramError(
                f"{self.controller.where}: expected a value that the program tells, got"
                f" {cause.value.name}"
            ) from cause
        except ProgramEnd:
            pass
        except RecursionError:
            raise ProgramError(
                f"{self.controller.where}: expected fewer blocks and calls in each other, got too many"
            ) from None
        except LoopExit:
            raise ProgramError(
                f"{self.controller.where}: expected EXIT in a loop, got it alone"
            ) from None
        self.motions.finish(self.controller.where)

    def _run(self, routine: Routine, values: Sequence[Value]) -> tuple[Value | None, Names]:
        """Run a routine with its arguments; return its result and its variables."""
        if self._depth >= _MAX_CALL_DEPTH:
            raise ProgramError(
                f"{self.controller.where}: expected at most {_MAX_CALL_DEPTH} calls in each other,"
                " got more"
            )
        local = Names()
        for k, (name, _) in enumerate(routine.parameters):
            local.types[name] = ""
            local.values[name, ()] = values[k] if k < len(values) else Unknown(name)
        before, module = self.controller.variables.enter(routine.module, local), self._module
        self._module, self._depth = routine.module, self._depth + 1
        result = None
        try:
            self._execute(routine.statements)
        except _ReturnError as done:
            result = done.value
        self.controller.variables.scopes = before
        self._module, self._depth = module, self._depth - 1
        return result, local

    # Blocks

    def _execute(self, statements: Sequence[Statement]) -> None:
        for statement in statements:
            if isinstance(statement, KrlLine):
                self._count(statement)
                self._take(statement)
            else:
                self._count(statement.line)
                self._blocks.run(statement)

    def _count(self, line: KrlLine) -> None:
        self.controller.where = line.where
        self.controller.step += 1
        self._budget.spend(line.where)

    def _exit(self, line: KrlLine) -> None:
        raise LoopExit

    def _return(self, line: KrlLine) -> None:
        value = (
            self.controller.valued(parse_expression(line.remaining, line.where))
            if line.remaining
            else None
        )
        raise _ReturnError(value)

    # Single statements

    def _take(self, line: KrlLine) -> None:
        executed = self._executed.get(line.word)
        if executed is not None and not line.remaining.startswith("="):
            executed(line)
            return
        if line.word in _REFUSED:
            raise ProgramError(
                f"{line.where}: expected statements one after the other, got {line.word}:"
                f" {_REFUSED[line.word]}"
            )
        require_no_call(line)
        word = harmless_word(line)
        if word is not None and self._routine(line.word) is None:
            self._leave(word, line)
        elif not (
            _LABEL.fullmatch(line.text) or self._declares(line) or self._assignments.assign(line)
        ):
            self._call(line)

    def _leave(self, word: str, line: KrlLine) -> None:
        if word == "CONTINUE":
            self._continued = self.controller.step + 1
        is_stop = word in _STOPPING and self.controller.step != self._continued
        if (word == "WAIT" or is_stop) and self.motions.wait(line, is_stop):
            return
        self.controller.notes.leave_out(word)
        if is_harmless_call(word):
            call, _ = leading(line.text, line.where)
            if isinstance(call, Call):
                self.controller.forget(call.arguments)

    def _declares(self, line: KrlLine) -> bool:
        """Make what a line declares known; return whether it declares something."""
        if line.text.upper().split(maxsplit=2)[:2] == ["GLOBAL", "INTERRUPT"]:
            self._interrupts.take(line)
            return True
        return self._assignments.declare(line)

    def _call(self, line: KrlLine) -> None:
        target, remaining = leading(line.text, line.where) if line.word else (None, "")
        if not isinstance(target, Call) or remaining:
            got = line.word if line.word else line.text
            raise ProgramError(
                f"{line.where}: expected a statement of KRL that is known, got {shorten(got)!r}: take"
                " it out if it does not change the path"
            )
        if self._run_function(target.name, target.arguments) is None:
            raise ProgramError(
                f"{line.where}: expected a program that is at hand, got {shorten(target.name)}: put"
                " its .src beside this one, or take the call out if it does not move the robot"
            )

    # Calls

    def _routine(self, name: str) -> Routine | None:
        """Return the routine that a name calls from here."""
        name = name.upper()
        return self._names.get((self._module, name)) or self._names.get(("", name))

    def _run_function(
        self, name: str, arguments: Sequence[Expression]
    ) -> tuple[Value | None] | None:
        """Run a routine of the program and return its result; None where there is none of that name."""
        routine = self._routine(name)
        if routine is None:
            return None
        where = self.controller.where
        if len(arguments) > len(routine.parameters):
            raise ProgramError(
                f"{where}: expected {len(routine.parameters)} arguments of {name}, got {len(arguments)}"
            )
        values = [self.controller.valued(part) for part in arguments]
        result, local = self._run(routine, values)
        self.controller.where = where
        for (parameter, is_value), part in zip(routine.parameters, arguments, strict=False):
            if not is_value and isinstance(part, Reference):
                self.controller.store(part, local.values[parameter, ()])
        return (result,)
