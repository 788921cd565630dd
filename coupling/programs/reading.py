"""What a reader tells beside the motions: statements left out, and assumptions made."""

from __future__ import annotations

from collections import Counter
from dataclasses import dataclass, field


@dataclass
class ReadingNotes:
    """Notes of a reader while it goes through a program.

    A statement is executed, left out because it cannot change the path, or refused; there is no fourth.

    Attributes:
        left_out: Words of statements that were left out, by how often.
        assumptions: Assumptions, sentences without a full stop, each once.
    """

    left_out: Counter[str] = field(default_factory=Counter)
    assumptions: list[str] = field(default_factory=list)

    def leave_out(self, word: str) -> None:
        """Note a statement that was left out, by its word."""
        self.left_out[word] += 1

    def assume(self, sentence: str) -> None:
        """Note an assumption."""
        if sentence not in self.assumptions:
            self.assumptions.append(sentence)
