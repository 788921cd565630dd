"""Declarations and assignments of KRL, executed: in routines and in the data of a .dat."""

from __future__ import annotations

from dataclasses import dataclass, field

from coupling.errors import ProgramError
from coupling.programs.krl.controller import KrlController
from coupling.programs.krl.declarations import declaration_of, structure_of
from coupling.programs.krl.expressions import Expression, Reference
from coupling.programs.krl.harmless import harmless_word
from coupling.programs.krl.memory import Names
from coupling.programs.krl.parser import leading, parse_expression
from coupling.programs.krl.syntax import KrlLine, lines_of
from coupling.programs.program import ProgramFile
from coupling.programs.text import shorten

_WITHOUT_VALUE = frozenset(["ENUM", "SIGNAL", "IMPORT", "EXT", "EXTFCT", "EXTP", "EXTFCTP"])
_HEADINGS = frozenset(("DEFDAT", "ENDDAT"))
# Data of all programs, as a controller keeps them.
CONFIGURATION = "$CONFIG"


@dataclass(frozen=True)
class Assignments:
    """Gives variables their types and values.

    Attributes:
        controller: State of the program.
    """

    controller: KrlController
    # Modules that declare data of all programs, by the data's names, and whether they are called.
    _owners: dict[str, tuple[str, bool]] = field(default_factory=dict)

    def load(self, file: ProgramFile, *, is_called: bool) -> None:
        """Take the data of a .dat over.

        Args:
            is_called: Whether it belongs to a .src that is at hand; of another, and of $config.dat, what
                is not understood has no value, and what uses it is refused there.

        Raises:
            ProgramError: If a line of a called one is neither a declaration nor an assignment.
        """
        module = file.name.rsplit(".", 1)[0].upper()
        variables = self.controller.variables
        variables.scopes = (variables.common,)
        if module != CONFIGURATION:
            variables.scopes = (
                variables.modules.setdefault(module, Names()),
                variables.common,
            )
        for line in lines_of(file):
            self.controller.where = line.where
            if line.word in _HEADINGS:
                continue
            try:
                self._take(line)
                if "GLOBAL" in line.text.upper():
                    self._note_owner(line, module, is_called)
            except ProgramError:
                if is_called:
                    raise
        variables.scopes = (variables.common,)

    def _note_owner(self, line: KrlLine, module: str, is_called: bool) -> None:
        """Note data of all programs that several modules declare; a called one's hold before others'."""
        declaration = declaration_of(line)
        for name in declaration.names if declaration is not None else ():
            owner, is_owner_called = self._owners.get(name, (module, is_called))
            if is_called != is_owner_called:
                self.controller.variables.ambiguous.discard(name)
            elif owner != module:
                self.controller.variables.ambiguous.add(name)
            self._owners[name] = (module, is_called)

    def _take(self, line: KrlLine) -> None:
        if self.declare(line):
            return
        if (word := harmless_word(line)) is not None:
            self.controller.notes.leave_out(word)
        elif not self.assign(line):
            raise ProgramError(
                f"{line.where}: expected declarations and values in a .dat, got {shorten(line.text)!r}"
            )

    def declare(self, line: KrlLine) -> bool:
        """Make what a line declares known; return whether it declares something.

        Raises:
            ProgramError: If its declaration is none.
        """
        words = line.text.upper().split(maxsplit=2)
        inner = words[1] if line.word == "GLOBAL" and len(words) > 1 else line.word
        if inner == "STRUC":
            name, kinds = structure_of(line)
            self.controller.variables.structures[name] = kinds
            return True
        return inner in _WITHOUT_VALUE or self._declare_variables(line)

    def _declare_variables(self, line: KrlLine) -> bool:
        declaration = declaration_of(line)
        if declaration is None:
            return False
        variables = self.controller.variables
        for name in declaration.names:
            variables.declare(name, declaration.kind, declaration.is_global)
            argument = variables.scopes[0].values.get((name, ()))
            if argument is not None and declaration.value is None:
                variables.write((name, ()), (), argument, line.where)
        if declaration.value is not None:
            target, text = declaration.value
            self._store(parse_expression(target, line.where), text, line)
        return True

    def assign(self, line: KrlLine) -> bool:
        """Give a variable its value; return whether a line is an assignment.

        Raises:
            ProgramError: If the value is none, or not for this variable.
        """
        if not line.word:
            return False
        target, remaining = leading(line.text, line.where)
        if (
            not isinstance(target, Reference)
            or not remaining.startswith("=")
            or remaining.startswith("==")
        ):
            return False
        self._store(target, remaining[1:], line)
        return True

    def _store(self, target: Expression, text: str, line: KrlLine) -> None:
        if not isinstance(target, Reference):
            raise ProgramError(f"{line.where}: expected a variable, got {shorten(line.text)!r}")
        self.controller.store(target, self.controller.valued(parse_expression(text, line.where)))
