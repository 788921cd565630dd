"""What the tables say of the project's goals: ratios of times within one run."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

from benchmarks.task import ENOUGH, Row

# How many times faster than others this stepper is meant to be, and how many times as long as the
# bare stepper the FMU may take.
_FASTER_THAN_MUJOCO = 1.5
_FASTER_WITH_BACKLASH = 10.0
_FMU_AT_MOST = 1.5
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
    """Return the line to which others are related: a table begins with this stepper's default."""
    return rows[0]


def goals(tables: dict[str, list[Row]]) -> list[Goal]:
    """Return the goals of a run's tables, by torque curve."""
    return [
        _faster(tables["linear"], "without backlash", ("MuJoCo",), _FASTER_THAN_MUJOCO),
        _faster(tables["backlash"], "with backlash", ("MuJoCo", "SciPy"), _FASTER_WITH_BACKLASH),
        *(_through_fmu(curve, rows) for curve, rows in tables.items()),
        _native_faster(tables["linear"], "without backlash", _NATIVE_FASTER_THAN_MUJOCO),
        _native_faster(tables["backlash"], "with backlash", _NATIVE_FASTER_WITH_BACKLASH),
    ]


def _faster(rows: list[Row], which: str, families: tuple[str, ...], wanted: float) -> Goal:
    """Compare with the fastest of other families that is accurate enough."""
    ours = default(rows)
    others = [row for row in rows if row.family in families and row.good]
    text = f"{which}, no {' or '.join(families)} setting within {ENOUGH:g} m"
    if not others:
        return Goal(text, f"at least {wanted:g}", float("inf"), ours.good)
    best = min(others, key=lambda row: row.spent)
    text = f"{which}, time of {best.name}, the fastest within {ENOUGH:g} m, over this stepper's"
    if not ours.good:
        text += f" (which errs by {ours.whole:.1e} m)"
    ratio = best.spent / ours.spent
    return Goal(text, f"at least {wanted:g}", ratio, ours.good and ratio >= wanted)


def _through_fmu(curve: str, rows: list[Row]) -> Goal:
    fmu = next(row for row in rows if row.family == "FMU")
    bare = next(row for row in rows if row.family == "bare stepper")
    ratio = fmu.spent / bare.spent
    text = f"{curve}, time through FMU and FMPy over the bare stepper's at the same points"
    return Goal(text, f"at most {_FMU_AT_MOST:g}", ratio, ratio <= _FMU_AT_MOST)


def _native_faster(rows: list[Row], which: str, wanted: float) -> Goal:
    """Compare the native FMU's fastest accurate line with MuJoCo's."""
    ours, other = _fastest(rows, "native"), _fastest(rows, "MuJoCo")
    ratio = other.spent / ours.spent
    text = f"{which}, time of {other.name} over that of {ours.name}"
    return Goal(text, f"at least {wanted:g}", ratio, ours.good and ratio >= wanted)


def _fastest(rows: list[Row], family: str) -> Row:
    """Return the fastest line within ENOUGH; the most accurate if none is."""
    own = [row for row in rows if row.family == family]
    return min(own, key=lambda row: row.spent if row.good else 1e9 * (1.0 + row.whole))
