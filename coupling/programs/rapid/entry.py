"""The procedure with which a program begins."""

from __future__ import annotations

from coupling.errors import ProgramError
from coupling.programs.rapid.instruction_classes import MOVES, REFUSED
from coupling.programs.rapid.syntax import (
    RapidInstruction,
    RapidModule,
    RapidRoutine,
    statements_in,
)
from coupling.programs.reading import ReadingNotes


def entry_of(
    modules: list[RapidModule], notes: ReadingNotes, file: str
) -> tuple[RapidRoutine, RapidModule]:
    """Return `main`, or the procedure with motions that no other calls, and its module.

    Raises:
        ProgramError: If there is none, or more than one.
    """
    for name in ("MAIN", ""):
        for module in modules:
            routine = module.routines.get(name)
            if routine is not None and routine.word == "PROC":
                return routine, module
    procedures = {
        name: (routine, module)
        for module in modules
        for name, routine in module.routines.items()
        if routine.word == "PROC"
    }
    words = {name: _words(routine) for name, (routine, _) in procedures.items()}
    moving = _moving(words)
    called = {word for name in moving for word in words[name] if word != name}
    roots = [procedures[name] for name in procedures if name in moving and name not in called]
    if not moving:
        raise ProgramError(f"{file}: expected motions, got none")
    if len(roots) != 1:
        names = (
            ", ".join(routine.name for routine, _ in roots[:5]) or "procedures that call each other"
        )
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


def _words(routine: RapidRoutine) -> set[str]:
    """Return the names of the instructions in a routine, in capitals."""
    return {
        statement.name.upper()
        for statement in statements_in(routine.body)
        if isinstance(statement, RapidInstruction)
    }


def _moving(words: dict[str, set[str]]) -> set[str]:
    """Return the procedures that have motions, or call one that has."""
    callers: dict[str, list[str]] = {}
    for name, called in words.items():
        for word in called:
            callers.setdefault(word, []).append(name)
    moving: set[str] = set()
    pending = [name for name, called in words.items() if called & (MOVES.keys() | REFUSED.keys())]
    while pending:
        name = pending.pop()
        if name not in moving:
            moving.add(name)
            pending += callers.get(name, [])
    return moving
