"""The best settings of a box: many points that fill it, then finer steps around the best of them."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from coupling.place.coarse_screen import CoarseScreen
from coupling.place.objective import PlaceObjective
from coupling.place.screen import ScreenFigures, join_figures
from coupling.place.settings import Ranges

# Settings that are refined, and how far they are apart at first, over the box.
_REFINED_COUNT, _FIRST_SEPARATION = 8, 0.12
# Settings this near to one that the whole path refuses are not begun with, over the box, and how many of
# those that a few places admit are looked at along it.
_REFUSED_DISTANCE, _CHECKED_COUNT = 0.03, 64
# First step of a refinement over the box, its factor from round to round, its last one.
_FIRST_STEP, _STEP_FACTOR, _LAST_STEP = 0.12, 0.72, 0.001
# Settings around each in every round: this part of those that fill the box, within bounds.
_SAMPLED_PART, _MIN_SAMPLES, _MAX_SAMPLES = 1.0 / 256.0, 12, 160

Report = Callable[[int, int], None]


@dataclass(frozen=True)
class FoundSettings:
    """Settings, the best first.

    Attributes:
        settings: By `NAMES` [m], [rad], (n, 9).
        figures: Their figures along the whole path.
        cost: Cost of each [m], (n,).
        refused: Number of those that fill the box and were refused, by reason.
    """

    settings: np.ndarray
    figures: ScreenFigures
    cost: np.ndarray
    looked_at: int
    refused: dict[str, int]


def fill_box(
    screen: CoarseScreen,
    ranges: Ranges,
    goal: PlaceObjective,
    count: int,
    seed: int,
    report: Report,
) -> FoundSettings:
    """Return the best of settings that fill a box, apart from each other; none if none is admitted."""
    settings = ranges.sampled(count, seed)
    figures = screen.figures(settings, lambda completed: report(completed, count))
    cost = goal.cost(figures)
    reasons = goal.demands.refusals(figures)
    refused = {what: int(np.sum(wrong)) for what, wrong in reasons.items()}
    remaining = np.argsort(cost, kind="stable")
    remaining = remaining[np.isfinite(cost[remaining])]
    chosen, parts, tried = settings[:0], [figures.chosen(remaining[:0])], 0
    while len(remaining) and len(chosen) < _REFINED_COUNT and tried < _CHECKED_COUNT:
        rows = _apart(ranges, settings, remaining, _REFINED_COUNT - len(chosen))
        whole = screen.confirmed(settings[rows])
        tried += len(rows)
        admitted = np.isfinite(goal.cost(whole))
        chosen = np.concatenate([chosen, settings[rows[admitted]]])
        parts.append(whole.chosen(np.flatnonzero(admitted)))
        for row, distance in zip(
            rows, np.where(admitted, _FIRST_SEPARATION, _REFUSED_DISTANCE), strict=True
        ):
            remaining = remaining[ranges.apart(settings[row], settings[remaining]) >= distance]
    return _sort_settings(goal, chosen, join_figures(parts), count, refused)


def refine_settings(
    screen: CoarseScreen,
    goal: PlaceObjective,
    ranges: Ranges,
    previous: FoundSettings,
    seed: int,
    report: Report,
) -> FoundSettings:
    """Return settings that are at least as good, each from one that was found."""
    if len(previous.settings) == 0 or len(ranges.free) == 0:
        return previous
    around = int(np.clip(_SAMPLED_PART * previous.looked_at, _MIN_SAMPLES, _MAX_SAMPLES))
    rounds = int(np.ceil(np.log(_LAST_STEP / _FIRST_STEP) / np.log(_STEP_FACTOR)))
    best, figures, cost = previous.settings, previous.figures, previous.cost
    rng, looked_at = np.random.default_rng(seed), previous.looked_at
    for number in range(rounds):
        report(number, rounds)
        step = _FIRST_STEP * _STEP_FACTOR**number
        tried = np.stack([ranges.around(setting, step, around, rng) for setting in best])
        looked_at += len(best) * around
        few = goal.cost(screen.figures(tried.reshape(-1, tried.shape[2]))).reshape(len(best), -1)
        rows = np.flatnonzero(few.min(axis=1) < cost)
        candidates = tried[rows, few.argmin(axis=1)[rows]]
        if len(rows) == 0:
            continue
        whole = screen.confirmed(candidates)
        better = goal.cost(whole) < cost[rows]
        settings, both = np.concatenate([best, candidates]), join_figures([figures, whole])
        now = np.arange(len(best))
        now[rows[better]] = len(best) + np.flatnonzero(better)
        best, figures = settings[now], both.chosen(now)
        cost = goal.cost(figures)
    return _sort_settings(goal, best, figures, looked_at, previous.refused)


def _sort_settings(
    goal: PlaceObjective,
    settings: np.ndarray,
    figures: ScreenFigures,
    looked_at: int,
    refused: dict[str, int],
) -> FoundSettings:
    cost = goal.cost(figures)
    order = np.argsort(cost, kind="stable")
    return FoundSettings(settings[order], figures.chosen(order), cost[order], looked_at, refused)


def _apart(ranges: Ranges, settings: np.ndarray, order: np.ndarray, most: int) -> np.ndarray:
    """Return the numbers of the first settings in an order that are apart from each other."""
    chosen: list[int] = []
    while len(order) and len(chosen) < most:
        first = int(order[0])
        chosen.append(first)
        order = order[ranges.apart(settings[first], settings[order]) >= _FIRST_SEPARATION]
    return np.array(chosen, dtype=int)
