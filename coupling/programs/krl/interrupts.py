"""Interrupts and triggers of KRL: left out where what they run cannot move the robot."""

from __future__ import annotations

import re
from collections.abc import Callable, Sequence
from dataclasses import dataclass, field

from coupling.errors import ProgramError
from coupling.programs.krl.controller import KrlController
from coupling.programs.krl.declarations import declaration_of
from coupling.programs.krl.expressions import Call, Reference
from coupling.programs.krl.harmless import harmless_word, is_harmless_call
from coupling.programs.krl.parser import leading
from coupling.programs.krl.syntax import KrlBlock, KrlLine, Routine, Statement, called_names
from coupling.programs.text import shorten

_DECLARATION = re.compile(
    r"(?:GLOBAL\s+)?INTERRUPT\s+(?:WITH\s+\S+\s+)?DECL\s+(\S+)\s+WHEN\s+(.+?)\s+DO\s+(.+)",
    re.IGNORECASE,
)
_SWITCHED = re.compile(r"INTERRUPT\s+(ON|OFF|ENABLE|DISABLE)\b\s*(\S*)", re.IGNORECASE)
_TRIGGERED = re.compile(r"\bDO\s+(.+?)(?:\s+PRIO\s*=.*)?$", re.IGNORECASE)
# Stops the robot on its path when a message does; every INI fold declares it.
_STOPPING = "IR_STOPM"
_MAX_CALL_DEPTH = 10
# Words before brackets in conditions, and calls that give no variable a value.
_CONDITION_WORDS = frozenset(
    ["IF", "WHILE", "UNTIL", "SWITCH", "CASE", "AND", "OR", "NOT", "EXOR", "THEN", "VARSTATE"]
)
_MESSAGE_CALLS = frozenset(("MSGNOTIFY", "MSGQUIT", "MSGSTATE"))


@dataclass
class Interrupts:
    """Interrupts that are declared.

    Attributes:
        controller: State of the program.
        routine: Function that gives the routine of a name.
    """

    controller: KrlController
    routine: Callable[[str], Routine | None]
    _moving: dict[str, str] = field(default_factory=dict)

    def take(self, line: KrlLine) -> None:
        """Declare or switch interrupts.

        Raises:
            ProgramError: If one is switched on that may move the robot.
        """
        if (declared := _DECLARATION.fullmatch(line.text)) is not None:
            word, _, action = declared.groups()
            if self._is_still(action, line):
                self._moving.pop(word, None)
            else:
                self._moving[word] = action
        elif (switched := _SWITCHED.fullmatch(line.text)) is not None:
            way, word = switched.groups()
            moving = [self._moving[word]] if word in self._moving else []
            if not word:
                moving = list(self._moving.values())
            if way.upper() in ("ON", "ENABLE") and moving:
                raise ProgramError(
                    f"{line.where}: expected interrupts that do not move the robot, got"
                    f" {shorten(moving[0])!r}: take it out if it does not"
                )
        else:
            raise ProgramError(
                f"{line.where}: expected INTERRUPT DECL, ON or OFF, got {shorten(line.text)!r}"
            )
        self.controller.notes.leave_out("INTERRUPT")

    def trigger(self, line: KrlLine) -> None:
        """Leave out an action on the path.

        Raises:
            ProgramError: If it may move the robot.
        """
        action = _TRIGGERED.search(line.text)
        if action is None or not self._is_still(action[1], line):
            raise ProgramError(
                f"{line.where}: expected a TRIGGER that does not move the robot, got"
                f" {shorten(line.text)!r}: take it out if it does not"
            )
        self.controller.notes.leave_out("TRIGGER")

    def _is_still(self, action: str, line: KrlLine) -> bool:
        """Return whether what an interrupt or a trigger does cannot move the robot."""
        word = action.split("(")[0].split("=")[0].strip().upper()
        if word == _STOPPING:
            return True
        inner = KrlLine(line.where, action, re.split(r"[\[.\s]", word)[0])
        if harmless_word(inner) is not None:
            return True
        target, remaining = leading(action, line.where)
        if isinstance(target, Call) and not remaining:
            routine = self.routine(target.name)
            return routine is not None and is_still(routine.statements, self.routine)
        if not isinstance(target, Reference) or not remaining.startswith("="):
            return False
        self.controller.volatile.add(target.name)
        return not target.name.startswith("$")


def _asks_only(block: KrlBlock) -> bool:
    """Return whether the conditions of a block call nothing."""
    lines = [line for line, _ in block.parts] + [block.end]
    return all(called_names(line.text) <= _CONDITION_WORDS for line in lines)


def _declares(line: KrlLine) -> bool:
    """Return whether a line declares variables without a value."""
    declaration = declaration_of(line)
    return declaration is not None and declaration.value is None


def is_still(
    statements: Sequence[Statement], routine: Callable[[str], Routine | None], depth: int = 0
) -> bool:
    """Return whether statements neither move the robot nor change what a later motion depends on."""
    if depth > _MAX_CALL_DEPTH:
        return False
    for statement in statements:
        if not isinstance(statement, KrlLine):
            if not _asks_only(statement) or not all(
                is_still(inner, routine, depth + 1) for _, inner in statement.parts
            ):
                return False
        elif (called := routine(statement.word)) is not None:
            if not is_still(called.statements, routine, depth + 1):
                return False
        elif is_harmless_call(statement.word) and statement.word not in _MESSAGE_CALLS:
            return False  # it may give a variable another value
        elif harmless_word(statement) is None and not _declares(statement):
            return False
    return True
