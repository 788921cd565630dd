"""Limits of work: statements that a reader executes, beyond those that stand in the text."""

from __future__ import annotations

from dataclasses import dataclass

from coupling.errors import ProgramError

MOST_REPEATED = 100_000


@dataclass
class Budget:
    """Statements that may still be executed.

    Attributes:
        remaining: Their number.
    """

    remaining: int = MOST_REPEATED

    def spend(self, where: str, count: int = 1) -> None:
        """Execute statements.

        Raises:
            ProgramError: If there were more than all of the text and the repeated ones.
        """
        self.remaining -= count
        if self.remaining < 0:
            raise ProgramError(
                f"{where}: expected a program that ends with at most {MOST_REPEATED} repeated"
                " statements, got more: a loop that does not end, or is too long; read a part of it"
            )
