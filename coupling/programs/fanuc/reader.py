"""FANUC TP, read: .ls programs are executed as a controller does, with those that they call."""

from __future__ import annotations

import re
from collections.abc import Sequence

from coupling.errors import ProgramError
from coupling.programs.fanuc.execution import FanucExecution
from coupling.programs.fanuc.syntax import TpText
from coupling.programs.program import ProgramFile, RobotProgram


def read(files: Sequence[ProgramFile]) -> RobotProgram:
    """Return the program of .ls files: the first one, and what it calls.

    Args:
        files: Texts, the one that is started first.

    Raises:
        ProgramError: With the line, what was expected and what was got.
    """
    if not files:
        raise ProgramError("FANUC: expected a file .ls, got none")
    texts = [TpText.of(file) for file in files]
    reader = FanucExecution({text.title.upper(): text for text in reversed(texts)})
    reader.run(texts[0])
    return reader.program(texts[0])


def find_called(text: str) -> tuple[str, ...]:
    """Return the names of the programs that a text calls or runs."""
    return tuple(
        name.upper() for name in re.findall(r"\b(?:CALL|RUN)\s+(\w+)", text, re.IGNORECASE)
    )
