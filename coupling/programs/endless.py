"""Loops that never end, as production programs have them: one pass of them is the path."""

from __future__ import annotations

from collections import Counter
from collections.abc import Callable
from typing import NoReturn

from coupling.errors import ProgramError
from coupling.programs.program import ProgramMove
from coupling.programs.reading import ReadingNotes


class ProgramEnd(Exception):  # noqa: N818 - no error
    """The program is at its end, however many calls and loops it stands in."""


def end_after_pass(
    begin: int,
    moves: list[ProgramMove],
    run_again: Callable[[], None],
    notes: ReadingNotes,
    where: str,
) -> NoReturn:
    """End a program behind the first pass of an endless loop, if the second makes the same motions.

    Args:
        begin: Number of motions before the loop.
        moves: Motions of the program, with those of the first pass; those of the second are removed.
        run_again: Function that executes a pass.
        notes: Notes of the reader.
        where: Place of the loop, for messages.

    Raises:
        ProgramEnd: If one pass is the path.
        ProgramError: If there is no motion in a pass, or the next pass makes others.
    """
    first_pass, left_out = moves[begin:], Counter(notes.left_out)
    if not first_pass:
        raise _refusal(where, "no motion in it")
    try:
        run_again()
    except ProgramError as cause:
        inner = str(cause).removeprefix(f"{where.partition(': ')[0]}: ")
        raise _refusal(where, f"in its second pass, {inner}") from cause
    if moves[begin + len(first_pass) :] != first_pass:
        raise _refusal(where, "other motions in its second pass")
    moves[begin:] = first_pass  # what waits in the second may have changed its end
    notes.left_out = left_out
    place = where.rpartition(": ")[2]
    notes.assume(f"the loop of {place} runs for ever: one pass of it is the path")
    raise ProgramEnd


def _refusal(where: str, reason: str) -> ProgramError:
    return ProgramError(
        f"{where}: expected a loop that ends, or makes the same motions for ever, got {reason}: write"
        " the statements of one pass"
    )
