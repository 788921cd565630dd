"""Blocks of KRL, executed: branches and loops, where the program itself decides."""

from __future__ import annotations

import re
from collections.abc import Callable, Sequence
from dataclasses import dataclass

from coupling.errors import ProgramError
from coupling.programs.endless import end_after_pass
from coupling.programs.krl.controller import KrlController
from coupling.programs.krl.expressions import Expression, Reference
from coupling.programs.krl.interrupts import is_still
from coupling.programs.krl.motions import Motions
from coupling.programs.krl.operators import apply_binary
from coupling.programs.krl.parser import parse_expression
from coupling.programs.krl.syntax import KrlBlock, KrlLine, Routine, Statement
from coupling.programs.krl.values import UnknownValueError, describe_value, number
from coupling.programs.text import shorten


class LoopExit(Exception):  # noqa: N818 - no error
    """EXIT leaves a loop."""


@dataclass
class Blocks:
    """Executes blocks.

    Attributes:
        controller: State of the program.
        motions: Motions so far.
        execute: Function that executes statements.
        count: Function that counts an executed line.
        routine: Function that gives the routine of a name.
    """

    controller: KrlController
    motions: Motions
    execute: Callable[[Sequence[Statement]], None]
    count: Callable[[KrlLine], None]
    routine: Callable[[str], Routine | None]

    def run(self, block: KrlBlock) -> None:
        """Execute a block.

        Raises:
            ProgramError: If the program does not decide what is executed.
        """
        try:
            {
                "IF": self._if,
                "SWITCH": self._switch,
                "FOR": self._for,
                "WHILE": self._while,
                "REPEAT": self._repeat,
                "LOOP": self._loop,
            }[block.line.word](block)
        except UnknownValueError as cause:
            line = block.line
            if line.word in ("IF", "SWITCH", "WHILE", "REPEAT") and is_still([block], self.routine):
                self.controller.notes.leave_out(line.word)
                return
            raise ProgramError(
                f"{line.where}: expected a condition that the program decides, got"
                f" {shorten(line.text)!r}, and {cause.value.name} is not known: write the statements"
                " that are executed"
            ) from cause

    def _if(self, block: KrlBlock) -> None:
        condition = re.sub(r"\s*\bTHEN\s*$", "", block.line.remaining, flags=re.IGNORECASE)
        if self._holds(condition, block.line):
            self.execute(block.parts[0][1])
        elif len(block.parts) > 1:
            self.execute(block.parts[1][1])

    def _holds(self, text: str, line: KrlLine) -> bool:
        value = parse_expression(text, line.where).evaluate(self.controller)
        if not isinstance(value, bool):
            raise ProgramError(f"{line.where}: expected TRUE or FALSE, got {describe_value(value)}")
        return value

    def _switch(self, block: KrlBlock) -> None:
        selected = parse_expression(block.line.remaining, block.line.where)
        for line, statements in block.parts[1:]:
            if line.word == "DEFAULT":
                self.execute(statements)
                return
            for text in line.remaining.split(","):
                case = parse_expression(text, line.where)
                if self._equal(selected, case, line):
                    self.execute(statements)
                    return

    def _equal(self, selected: Expression, case: Expression, line: KrlLine) -> bool:
        values = (selected.evaluate(self.controller), case.evaluate(self.controller))
        return apply_binary("==", *values, line.where) is True

    def _for(self, block: KrlBlock) -> None:
        name, *texts = block.loop.groups()
        where = block.line.where
        begin, end, step = (
            number(parse_expression(text or "1", where).evaluate(self.controller), where)
            for text in texts
        )
        if step == 0:
            raise ProgramError(f"{where}: expected a STEP other than 0, got 0")
        counter = Reference(name.upper())
        self.controller.store(counter, begin)
        while True:
            value = number(self.controller.value(counter), where)
            if value > end if step > 0 else value < end:
                return
            self.count(block.line)
            if not self._pass(block.parts[0][1]):
                return
            self.controller.where = where
            self.controller.store(counter, number(self.controller.value(counter), where) + step)

    def _while(self, block: KrlBlock) -> None:
        if _bare(block.line.remaining) == "TRUE":
            self._loop(block)
            return
        while self._holds(block.line.remaining, block.line):
            self._require_change(block)
            if not self._pass(block.parts[0][1]):
                return
            self.count(block.line)

    def _repeat(self, block: KrlBlock) -> None:
        if _bare(block.end.remaining) == "FALSE":
            self._loop(block)
            return
        while self._pass(block.parts[0][1]):
            self.count(block.end)
            if self._holds(block.end.remaining, block.end):
                return
            self._require_change(block)

    def _require_change(self, block: KrlBlock) -> None:
        """Refuse another pass that cannot change whether there is a further one."""
        if is_still(block.parts[0][1], self.routine):
            raise ProgramError(
                f"{block.line.where}: expected a loop that ends by itself, got"
                f" {shorten(block.line.text)!r}, which waits for ever: take it out"
            )

    def _loop(self, block: KrlBlock) -> None:
        """Execute a loop that EXIT or RETURN alone can end."""
        statements, motions = block.parts[0][1], self.motions
        if not _can_leave(statements):
            begin = len(motions.moves)
            self.execute(statements)

            def run_again() -> None:
                motions.begin_again()
                self.execute(statements)

            end_after_pass(begin, motions.moves, run_again, self.controller.notes, block.line.where)
        while self._pass(statements):
            self.count(block.line)

    def _pass(self, statements: Sequence[Statement]) -> bool:
        """Execute one pass of a loop; return whether it goes on."""
        try:
            self.execute(statements)
        except LoopExit:
            return False
        return True


def _bare(condition: str) -> str:
    return condition.strip("() \t").upper()


def _can_leave(statements: Sequence[Statement]) -> bool:
    """Return whether statements may leave the loop that they stand in."""
    for statement in statements:
        if isinstance(statement, KrlLine):
            if statement.word in ("EXIT", "RETURN", "GOTO"):
                return True
        elif any(_can_leave(inner) for _, inner in statement.parts):
            return True
    return False
