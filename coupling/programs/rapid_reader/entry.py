"""The procedure with which a program begins."""

from __future__ import annotations

from coupling.errors import ProgramError
from coupling.programs.rapid_reader.instructions import MOVES, REFUSED
from coupling.programs.rapid_reader.memory import Frame, Memory
from coupling.programs.rapid_reader.syntax import Instruction, Module, Routine, statements_in
from coupling.programs.reading import ReadingNotes


def entry_of(
    modules: list[Module], memory: Memory, notes: ReadingNotes, file: str
) -> tuple[Routine, Module]:
    """Return `main`, or the procedure with motions that no other calls, and its module.

    Raises:
        ProgramError: If there is none, or more than one.
    """
    for name in ("MAIN", ""):
        for module in modules:
            routine = module.routines.get(name)
            if routine is not None and routine.word == "PROC":
                return routine, module
    moving = [
        (routine, module)
        for module in modules
        for routine in module.routines.values()
        if routine.word == "PROC" and _moves(routine, Frame(module), memory, set())
    ]
    called = {
        found[0].where
        for routine, module in moving
        for found in _called(routine, Frame(module), memory)
        if found[0] is not routine
    }
    roots = [pair for pair in moving if pair[0].where not in called]
    if not roots:
        raise ProgramError(f"{file}: expected motions, got none")
    if len(roots) > 1:
        names = ", ".join(routine.name for routine, _ in roots[:5])
        raise ProgramError(
            f"{file}: expected main, or one procedure with motions, got {names}: add a main that calls"
            " what is wanted"
        )
    ((routine, module),) = roots
    if any(not parameter.is_optional for parameter in routine.parameters):
        raise ProgramError(
            f"{routine.where}: expected a procedure without parameters, got {routine.name}: add a main"
            " that calls it"
        )
    if len(moving) > 1:
        notes.assume(f"it begins with {routine.name}, which no other procedure calls")
    return routine, module


def _called(routine: Routine, frame: Frame, memory: Memory) -> list[tuple[Routine, Module]]:
    """Return the procedures of the same file that a routine calls."""
    names = {
        statement.name.upper(): statement
        for statement in statements_in(routine.body)
        if isinstance(statement, Instruction) and statement.name
    }
    found = []
    for name in names:
        for module in memory.modules:
            called = module.routines.get(name)
            if called is not None and (module is frame.module or not called.is_local):
                found.append((called, module))
                break
    return found


def _moves(routine: Routine, frame: Frame, memory: Memory, seen: set[int]) -> bool:
    """Return whether a routine, or what it calls, has motions."""
    seen.add(id(routine))
    for statement in statements_in(routine.body):
        if isinstance(statement, Instruction):
            word = statement.name.upper()
            if word in MOVES or word in REFUSED:
                return True
    return any(
        id(called) not in seen and _moves(called, Frame(module), memory, seen)
        for called, module in _called(routine, frame, memory)
    )
