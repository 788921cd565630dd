"""A FANUC program that runs: its text, what it was called with, and the values of its expressions."""

from __future__ import annotations

from dataclasses import dataclass, field

from coupling.errors import ProgramError
from coupling.programs.fanuc.expressions import Value, evaluate, whole_number
from coupling.programs.fanuc.memory import Registers
from coupling.programs.fanuc.positions import TpPosition, position_of
from coupling.programs.fanuc.syntax import TpText
from coupling.programs.text import shorten
from coupling.programs.unknown import Unknown


@dataclass
class RunningProgram:
    """A program that runs.

    Attributes:
        text: Its text.
        registers: State of the controller.
        arguments: Values that it was called with.
        offsets: Position registers of OFFSET CONDITION and TOOL_OFFSET CONDITION, by the first word.
        depth: Number of programs that it was called through.
        ends: Ends of its loops, by the index of FOR.
        begins: Numbers of motions before its labels, where they were passed last, by their index.
    """

    text: TpText
    registers: Registers
    arguments: tuple[Value, ...] = ()
    offsets: dict[str, int] = field(default_factory=dict)
    depth: int = 0
    ends: dict[int, float] = field(default_factory=dict)
    begins: dict[int, int] = field(default_factory=dict)

    def value(self, expression: str, where: str) -> Value:
        """Return the value of an expression."""

        def lookup(name: str, indices: tuple[int, ...]) -> Value:
            return self.registers.value(name, indices, self.arguments)

        return evaluate(expression, lookup, where)

    def require_number(self, expression: str, where: str) -> float:
        """Return the value of an expression that must be known.

        Raises:
            ProgramError: If it is not.
        """
        value = self.value(expression, where)
        if isinstance(value, (Unknown, str)):
            name = value.name if isinstance(value, Unknown) else repr(value)
            raise ProgramError(
                f"{where}: expected a number that the program sets, got {shorten(name)}: set it before"
            )
        return float(value)

    def index(self, expression: str, where: str) -> int:
        """Return the number of a register or a position."""
        return whole_number(self.value(expression, where), f"{where}: [{shorten(expression)}]")

    def taught(self, index: int, where: str) -> TpPosition:
        """Return a position of the program's own data."""
        data = self.text.positions.get(index)
        if data is None:
            raise ProgramError(f"{where}: expected a position in /POS, got none for P[{index}]")
        return position_of(data, f"{self.text.file}: P[{index}]")
