"""Statements that may be executed or not: left out where they cannot change the path."""

from __future__ import annotations

from dataclasses import dataclass

from coupling.errors import ProgramError
from coupling.programs.rapid.effects import effects_of, effects_of_routine
from coupling.programs.rapid.memory import RapidMemory, RoutineScope
from coupling.programs.rapid.syntax import Block, Connect
from coupling.programs.reading import ReadingNotes
from coupling.programs.text import shorten
from coupling.programs.unknown import Unknown


@dataclass
class Undecided:
    """Leaves statements out, and forgets the data that they may change.

    Attributes:
        memory: Data and routines by their names.
        notes: Statements left out, and assumptions.
    """

    memory: RapidMemory
    notes: ReadingNotes

    def leave(
        self, word: str, block: Block, scope: RoutineScope, where: str, cause: Unknown
    ) -> None:
        """Leave statements out that may be executed or not, if they cannot change the path.

        Raises:
            ProgramError: If they can.
        """
        effects = effects_of(block, self.memory, scope)
        reason = cause.name
        if effects.blocker:
            raise ProgramError(
                f"{where}: expected a condition that the program decides for {effects.blocker}, got"
                f" {word} with {reason}: write the way that is wanted"
            )
        for variable in effects.changed:
            variable.set(Unknown(f"what depends on {reason.removeprefix('what depends on ')}"))
        line = where.rsplit(": ", 1)[-1]
        for stop in effects.stops:
            self.notes.assume(f"{stop} behind {word} in {line} is not reached")
        self.notes.leave_out(word)

    def connect(self, statement: Connect, scope: RoutineScope) -> None:
        """Take an interrupt, which may come at any time, if its trap leaves the path."""
        trap = self.memory.routine(statement.trap, scope)
        if trap is None:
            raise ProgramError(
                f"{statement.where}: expected a trap of the program, got"
                f" {shorten(statement.trap)!r}: put its module beside the program"
            )
        routine, module = trap
        effects = effects_of_routine(routine, self.memory, RoutineScope(module))
        if effects.blocker:
            raise ProgramError(
                f"{statement.where}: expected traps that leave the path, got {routine.name} with"
                f" {effects.blocker}: leave the interrupt out"
            )
        for variable in effects.changed:
            variable.set(Unknown(f"what trap {routine.name} changes"))
            variable.interrupted = routine.name
        for stop in effects.stops:
            self.notes.assume(f"the interrupt of trap {routine.name}, with {stop}, does not come")
        self.notes.leave_out("CONNECT")
