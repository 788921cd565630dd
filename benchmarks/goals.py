"""What the tables say of the project's goals: ratios of times within one run."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

from benchmarks.task import Row

# How many times faster than the fastest accurate MuJoCo the native FMU is meant to be.
_NATIVE_FASTER_THAN_MUJOCO = 25.0
_NATIVE_FASTER_WITH_BACKLASH = 40.0


@dataclass(frozen=True)
class Goal:
    """One goal and what a run reached.

    Attributes:
        text: What was compared.
        wanted: The goal, as words.
        ratio: What was measured.
        reached: Whether that meets the goal.
    """

    text: str
    wanted: str
    ratio: float
    reached: bool

    def __str__(self) -> str:
        verdict = "reached" if self.reached else "not reached"
        return f"{self.text}: {self.ratio:.2f} ({self.wanted}; {verdict})"


def default(rows: Sequence[Row]) -> Row:
    """Return the line to which others are related: the first."""
    return rows[0]


def goals(tables: dict[str, list[Row]]) -> list[Goal]:
    """Return the goals of a run's tables, by torque curve."""
    return [
        _native_faster(tables["linear"], "without backlash", _NATIVE_FASTER_THAN_MUJOCO),
        _native_faster(tables["backlash"], "with backlash", _NATIVE_FASTER_WITH_BACKLASH),
    ]


def _native_faster(rows: list[Row], which: str, wanted: float) -> Goal:
    """Compare the native FMU's fastest accurate line with MuJoCo's."""
    ours, other = _fastest(rows, "native"), _fastest(rows, "MuJoCo")
    ratio = other.spent / ours.spent
    text = f"{which}, time of {other.name} over that of {ours.name}"
    return Goal(text, f"at least {wanted:g}", ratio, ours.good and ratio >= wanted)


def _fastest(rows: list[Row], family: str) -> Row:
    """Return the fastest line that is accurate enough; the most accurate if none is."""
    own = [row for row in rows if row.family == family]
    return min(own, key=lambda row: row.spent if row.good else 1e9 * (1.0 + row.whole))
