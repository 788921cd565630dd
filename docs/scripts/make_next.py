"""Write the tables of docs/next.md: make next.

Robots that are not the model are measured four times, in simulation, and each next command is computed
from that.  The tables on parameters take longer and are made by name:
python docs/scripts/make_next.py parameters coverage.
"""

from __future__ import annotations

import sys
from dataclasses import replace
from functools import cache

from docs.scripts.learning_coverage import coverage
from docs.scripts.learning_shop import cone
from docs.scripts.learning_studies import hidden
from docs.scripts.next_histories import (
    CONE,
    EXTRAS,
    ISO,
    PYRAMID,
    Trial,
    TrialResult,
    trial_results,
)
from docs.scripts.page import finish, replace_parts, table

# The non-repeatable part of a run: a shift and a drift [m].
ANEW = replace(EXTRAS, again=1e-5)
TRIALS = (
    (Trial(CONE, 17), "extras"),
    (Trial(PYRAMID, 12, 0.25), "extras"),
    (Trial(ISO, 19), "extras"),
    (Trial(CONE, 52, 0.5, ANEW), "extras, and 10 um not repeatable"),
)
# Seeds of the robots whose parameters are learned.
SEEDS = (11, 12, 13, 14, 15)


@cache
def _results() -> tuple[TrialResult, ...]:
    return tuple(trial_results([trial for trial, _ in TRIALS]))


def histories() -> str:
    """Return what is left after every run."""
    rows = []
    for result, (trial, words) in zip(_results(), TRIALS, strict=True):
        first, last = result.runs[0], result.runs[-1]
        held = result.held
        rows.append(
            (
                trial.name,
                words,
                result.row,
                f"{1e6 * first.maximum:.0f} → {1e6 * last.maximum:.0f}",
                ", ".join(run.move for run in result.runs[1:]),
                f"{sum(held)} of {len(held)}",
            )
        )
    head = ("robot and path", "", "rms after every run [um]", "largest [um]", "moves")
    return table((*head, "forecasts held"), rows)


def sums() -> str:
    """Return what holds over all of them."""
    held = [holds for result in _results() for holds in result.held]
    worse = [result.trial.name for result in _results() if not result.never_worse]
    commands = sum(result.commands_never_worse for result in _results())
    rows = [
        ("histories of four runs", f"{len(TRIALS)}"),
        (
            "last run within 10 % of the best and below the first",
            f"{len(TRIALS) - len(worse)}" + (f" (except: {'; '.join(worse)})" if worse else ""),
        ),
        ("the same for the last command, without the non-repeatable part", f"{commands}"),
        ("forecasts whose range contains the next run", f"{sum(held)} of {len(held)}"),
    ]
    return table(("", ""), rows)


def parameters() -> str:
    """Return what the commands leave on robots whose parameters are hidden and learned."""
    rows = []
    for number, seed in enumerate(SEEDS, start=1):
        left, seconds = cone().learned(hidden(cone().robot, seed), seed)
        times = ", ".join(f"{clock:.0f} ({cpu:.0f})" for clock, cpu in seconds)
        rows.append((f"{number}", *map(str, left), times))
    head = ("robot", "with its file", "one run", "two runs", "time of the fits (CPU) [s]")
    return table(head, rows)


PARTS = {"histories": histories, "sums": sums}
SLOW_PARTS = {"parameters": parameters, "coverage": coverage}


if __name__ == "__main__":
    names = sys.argv[1:] or list(PARTS)
    sys.exit(finish(lambda: replace_parts("next", PARTS | SLOW_PARTS, names)))
