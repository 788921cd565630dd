"""The best settings of a box: many points that fill it, then finer steps around the best of them."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from coupling.place.objective import Goal
from coupling.place.screen import Figures, Screen, joined
from coupling.place.settings import Ranges

# Settings that are refined, and how far they are apart at first, over the box.
_REFINED, _APART = 8, 0.12
# First step of a refinement over the box, and its factor from round to round: a search ends with a
# thousandth, and another one begins with a fiftieth.
COARSE, FINE, _FINER, _LAST = 0.12, 0.02, 0.72, 0.001
# Settings around each in every round: this part of those that fill the box, within bounds.
_PART, _FEWEST, _MOST = 1.0 / 256.0, 12, 160

Told = Callable[[int, int], None]


@dataclass(frozen=True)
class Found:
    """Settings, the best first.

    Attributes:
        settings: By `NAMES` [m], [rad], (n, 8).
        figures: What they come to.
        cost: Of the goal [m], (n,).
        looked_at: Number of settings that were looked at.
        refused: Number of those that fill the box and were refused, by reason.
    """

    settings: np.ndarray
    figures: Figures
    cost: np.ndarray
    looked_at: int
    refused: dict[str, int]


def filled(screen: Screen, ranges: Ranges, goal: Goal, count: int, seed: int, told: Told) -> Found:
    """Return the best of settings that fill a box, apart from each other; none where none is admitted.

    Args:
        screen: Looks at settings.
        ranges: The box.
        goal: What is to be small.
        count: How many fill the box.
        seed: Of their choice.
        told: Told how many of them are looked at.
    """
    settings = ranges.sampled(count, seed)
    figures = screen.figures(settings, lambda done: told(done, count))
    cost = goal.cost(figures)
    reasons = goal.demands.refusals(figures)
    refused = {what: int(np.sum(wrong)) for what, wrong in reasons.items()}
    rows = _apart(ranges, settings, cost)
    return Found(settings[rows], figures.chosen(rows), cost[rows], count, refused)


def refined(
    screen: Screen, goal: Goal, ranges: Ranges, found: Found, step: float, seed: int, told: Told
) -> Found:
    """Return settings that are at least as good, each from one that was found.

    Args:
        screen: Looks at settings; it may look at other places than the one that has found them.
        goal: What is to be small.
        ranges: The box.
        found: The settings.
        step: First step over the box.
        seed: Of the steps.
        told: Told how many rounds are done.
    """
    if len(found.settings) == 0 or len(ranges.free) == 0:
        return found
    around = int(np.clip(_PART * found.looked_at, _FEWEST, _MOST))
    rounds = int(np.ceil(np.log(_LAST / step) / np.log(_FINER)))
    best, rng, looked_at = found.settings, np.random.default_rng(seed), found.looked_at
    figures = screen.figures(best)
    for number in range(rounds):
        tried = np.concatenate([ranges.around(own, step, around, rng) for own in best])
        looked_at += len(tried)
        settings = np.concatenate([best, tried])
        figures = joined([figures, screen.figures(tried)])
        own = np.concatenate([np.arange(len(best)), np.repeat(np.arange(len(best)), around)])
        order = np.lexsort((goal.cost(figures), own))
        rows = order[np.searchsorted(own[order], np.arange(len(best)))]
        best, figures = settings[rows], figures.chosen(rows)
        step *= _FINER
        told(number + 1, rounds)
    cost = goal.cost(figures)
    order = np.argsort(cost, kind="stable")
    return Found(best[order], figures.chosen(order), cost[order], looked_at, found.refused)


def _apart(ranges: Ranges, settings: np.ndarray, cost: np.ndarray) -> np.ndarray:
    """Return the numbers of the best settings that are apart from each other."""
    order = np.argsort(cost, kind="stable")
    order = order[np.isfinite(cost[order])]
    chosen: list[int] = []
    while len(order) and len(chosen) < _REFINED:
        best = int(order[0])
        chosen.append(best)
        order = order[ranges.apart(settings[best], settings[order]) >= _APART]
    return np.array(chosen, dtype=int)
