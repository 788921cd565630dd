"""Write the tables and the picture of docs/next.md: make next.

Robots that are not the model are measured four times, in simulation, and each next command is computed
from that; with names, only those parts: python docs/scripts/make_next.py extras others.
"""

from __future__ import annotations

import sys
from dataclasses import replace
from functools import cache

import plotly.graph_objects as go

from coupling.report.colours import JOINTS
from docs.scripts.next_histories import (
    CONE,
    EXTRAS,
    ISO,
    NONE,
    PYRAMID,
    Trial,
    TrialResult,
    trial_result,
    trial_results,
)
from docs.scripts.page import finish, replace_parts, table
from docs.scripts.pictures import save, styled

# Path, seed of the hidden parameters, factor of the stiffness.
WITH = (
    (CONE, 11, 0.25),
    (CONE, 21, 0.25),
    (CONE, 14, 0.5),
    (CONE, 24, 0.5),
    (CONE, 17, 1.0),
    (CONE, 27, 1.0),
    (PYRAMID, 12, 0.25),
    (PYRAMID, 15, 0.5),
    (PYRAMID, 25, 0.5),
    (PYRAMID, 18, 1.0),
    (PYRAMID, 28, 1.0),
    (ISO, 13, 0.25),
    (ISO, 16, 0.5),
    (ISO, 19, 1.0),
    (ISO, 29, 1.0),
)
WITHOUT = tuple(
    (path, seed, stiffness)
    for path, first in ((CONE, 31), (PYRAMID, 32), (ISO, 33))
    for seed, stiffness in ((first, 0.25), (first + 3, 0.5), (first + 6, 1.0))
)
# The non-repeatable part of a run: a shift and a drift [m].
ANEW = replace(EXTRAS, again=1e-5)


@cache
def _extras() -> tuple[TrialResult, ...]:
    return tuple(trial_results([Trial(*own) for own in WITH]))


@cache
def _none() -> tuple[TrialResult, ...]:
    return tuple(trial_results([Trial(*own, NONE) for own in WITHOUT]))


@cache
def _others() -> tuple[TrialResult, ...]:
    return tuple(trial_results(list(OTHERS.values())))


OTHERS = {
    "exact file, extras": Trial(CONE, 0),
    "backlash of 0.1 mrad, extras": Trial(CONE, 61, robot="fanuc_r2000ic", backlash=1e-4),
    "backlash of 0.1 mrad": Trial(PYRAMID, 62, extras=NONE, robot="abb_irb7600", backlash=1e-4),
    "extras, and 10 um not repeatable": Trial(CONE, 52, 0.5, ANEW),
    "exact file, geometric error of 0.3 mm over 0.1 m": Trial(
        CONE, 0, extras=replace(NONE, geometry=3e-4)
    ),
    "gears without backlash, twice the modes": Trial(CONE, 0, extras=NONE, linear=True),
}


def extras() -> str:
    """Return what is left of robots with parameters and extras that the model has not."""
    return _table([(own, "") for own in _extras()])


def none() -> str:
    """Return the same without extras."""
    return _table([(own, "") for own in _none()])


def others() -> str:
    """Return the same of other robots, and of what is in no model."""
    return _table([(own, words) for words, own in zip(OTHERS, _others(), strict=True)])


def _table(rows: list[tuple[TrialResult, str]]) -> str:
    head = (
        "robot and path",
        "",
        "rms after every run [um]",
        "largest [um]",
        "moves",
        "forecasts held",
    )
    lines = []
    for own, words in rows:
        first, last = own.runs[0], own.runs[-1]
        held = own.held
        lines.append(
            (
                own.trial.name,
                words,
                own.row,
                f"{1e6 * first.maximum:.0f} → {1e6 * last.maximum:.0f}",
                ", ".join(p.move for p in own.runs[1:]),
                f"{sum(held)} of {len(held)}",
            )
        )
    return table(head, lines)


def sums() -> str:
    """Return what holds over all of them."""
    every = [*_extras(), *_none(), *_others()]
    held = [own for one in every for own in one.held]
    worst = [one.trial.name for one in every if not one.never_worse]
    commands = sum(one.commands_never_worse for one in every)
    anew = _others()[list(OTHERS).index("extras, and 10 um not repeatable")]
    rows = [
        ("histories of four runs", f"{len(every)}"),
        (
            "last run within 10 % of the best and below the first",
            f"{len(every) - len(worst)}" + (f" (except: {'; '.join(worst)})" if worst else ""),
        ),
        ("the same for the last command, without the non-repeatable part", f"{commands}"),
        ("10 um not repeatable: deviation of each command without it [um]", anew.commands_row),
        ("forecasts whose interval contains the next run", f"{sum(held)} of {len(held)}"),
        (
            "with extras, largest rms after four runs [um]",
            f"{1e6 * max(one.runs[-1].rms for one in _extras()):.1f}",
        ),
        (
            "without, largest rms after two measured runs [um]",
            f"{1e6 * max(one.runs[2].rms for one in _none()):.1f}",
        ),
    ]
    return table(("", ""), rows)


def picture() -> str:
    """Draw the distance from the path in every run of one robot."""
    own = trial_result(Trial(*WITH[0]))
    figure = go.Figure()
    for number, distance in enumerate(own.distance, start=1):
        figure.add_scatter(
            x=own.time[::5],
            y=1e6 * distance[::5],
            mode="lines",
            name=f"run {number}",
            line={"width": 1.4, "color": JOINTS[number - 1]},
        )
    figure.update_xaxes(title="time [s]")
    figure.update_yaxes(
        title="distance of the tool from its path [um]", type="log", range=[-0.5, 3]
    )
    save("next", styled(figure, 1000, 420))
    return "![Distance of the tool from its path in four runs](figures/next.png)"


PARTS = {
    "picture": picture,
    "extras": extras,
    "none": none,
    "others": others,
    "sums": sums,
}


if __name__ == "__main__":
    sys.exit(finish(lambda: replace_parts("next", PARTS, sys.argv[1:])))
