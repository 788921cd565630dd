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
# Rounds of refinement, settings in each around each, first step over the box and its factor from round
# to round: the last steps are a thousandth.
_ROUNDS, _AROUND, _STEP, _FINER = 16, 160, 0.12, 0.72


@dataclass(frozen=True)
class Found:
    """Settings, the best first.

    Attributes:
        settings: By `NAMES` [m], [rad], (n, 8).
        figures: What they come to.
        cost: Of the goal [m], (n,).
        screened: Number of settings that were looked at.
        refused: Number of those of the first look that were refused, by reason.
    """

    settings: np.ndarray
    figures: Figures
    cost: np.ndarray
    screened: int
    refused: dict[str, int]


def search(
    screen: Screen,
    ranges: Ranges,
    goal: Goal,
    count: int,
    seed: int,
    told: Callable[[int, int], None] = lambda done, total: None,
) -> Found:
    """Return settings of low cost that are apart from each other; none where none is admitted.

    Args:
        screen: Looks at settings.
        ranges: The box.
        goal: What is to be small.
        count: Settings that fill the box.
        seed: Of all that is random.
        told: Told how many settings of all are looked at.
    """
    total = count + _ROUNDS * _AROUND * _REFINED
    settings = ranges.sampled(count, seed)
    figures = screen.figures(settings, lambda done: told(done, total))
    cost = goal.cost(figures)
    reasons = goal.demands.refusals(figures)
    refused = {what: int(np.sum(wrong)) for what, wrong in reasons.items()}
    rows = _apart(ranges, settings, cost, _APART, _REFINED)
    best, of_best, costs = settings[rows], figures.chosen(rows), cost[rows]
    screened, rng, step = count, np.random.default_rng(seed), _STEP
    for _ in range(_ROUNDS if len(rows) and len(ranges.free) else 0):
        tried = np.concatenate([ranges.around(own, step, _AROUND, rng) for own in best])
        seen = screen.figures(tried)
        screened += len(tried)
        told(screened, total)
        all_settings = np.concatenate([best, tried])
        all_figures, all_costs = joined([of_best, seen]), np.concatenate([costs, goal.cost(seen)])
        own = np.concatenate([np.arange(len(best)), np.repeat(np.arange(len(best)), _AROUND)])
        order = np.lexsort((all_costs, own))
        rows = order[np.searchsorted(own[order], np.arange(len(best)))]
        best, of_best, costs = all_settings[rows], all_figures.chosen(rows), all_costs[rows]
        step *= _FINER
    told(total, total)
    order = np.argsort(costs, kind="stable")
    return Found(best[order], of_best.chosen(order), costs[order], screened, refused)


def _apart(
    ranges: Ranges, settings: np.ndarray, cost: np.ndarray, distance: float, most: int
) -> np.ndarray:
    """Return the numbers of the best settings that are so far apart, so many at most."""
    order = np.argsort(cost, kind="stable")
    order = order[np.isfinite(cost[order])]
    chosen: list[int] = []
    while len(order) and len(chosen) < most:
        best = int(order[0])
        chosen.append(best)
        order = order[ranges.apart(settings[best], settings[order]) >= distance]
    return np.array(chosen, dtype=int)
