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
# Settings that are looked at at once, of those that may be the best.
_AT_ONCE = 512
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
        refused: Number of those that fill the box and were refused, by reason: at three places of the
            path, and where they may be the best at more.
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
    bounding = screen.bounds(settings, lambda completed: report(completed, count))
    filling = _Filling(screen, ranges, goal, settings, goal.cost(bounding))
    filling.refuse(bounding)
    chosen, parts, tried = settings[:0], [bounding.chosen(np.arange(0))], 0
    while len(chosen) < _REFINED_COUNT and tried < _CHECKED_COUNT:
        rows = filling.best_apart(_REFINED_COUNT - len(chosen))
        if len(rows) == 0:
            break
        whole = screen.confirmed(settings[rows])
        tried += len(rows)
        admitted = np.isfinite(goal.cost(whole))
        chosen = np.concatenate([chosen, settings[rows[admitted]]])
        parts.append(whole.chosen(np.flatnonzero(admitted)))
        for row, distance in zip(
            rows.tolist(),
            np.where(admitted, _FIRST_SEPARATION, _REFUSED_DISTANCE).tolist(),
            strict=True,
        ):
            filling.leave_out(row, distance)
    return _sort_settings(goal, chosen, join_figures(parts), count, filling.refused)


class _Filling:
    """Settings that fill a box, of which those are looked at that may be the best.

    Their figures at three places bound the cost from below, so that none behind those looked at costs
    less than the bound of the next one.

    Args:
        bound: Least cost of each [m], (n,); infinite where it is refused.

    Attributes:
        refused: Number of those that are refused, by reason, as far as they were looked at.
    """

    def __init__(
        self,
        screen: CoarseScreen,
        ranges: Ranges,
        goal: PlaceObjective,
        settings: np.ndarray,
        bound: np.ndarray,
    ) -> None:
        self._screen, self._ranges, self._goal, self._settings = screen, ranges, goal, settings
        order = np.argsort(bound, kind="stable")
        self._next, self._cost = order[np.isfinite(bound[order])], bound.copy()
        self._known = order[:0]  # by their cost
        self._around: list[tuple[int, float]] = []
        self.refused: dict[str, int] = {}

    def refuse(self, figures: ScreenFigures) -> None:
        """Count settings that are refused by their figures."""
        for what, wrong in self._goal.demands.refusals(figures).items():
            self.refused[what] = self.refused.get(what, 0) + int(np.sum(wrong))

    def best_apart(self, most: int) -> np.ndarray:
        """Return the numbers of the best that are apart from each other; none where none remain."""
        while True:
            least = self._cost[self._next[0]] if len(self._next) else np.inf
            ready = self._known[self._cost[self._known] <= least]
            if len(ready) or not len(self._next):
                return _apart(self._ranges, self._settings, ready, most)
            self._look_at_more()

    def _look_at_more(self) -> None:
        rows, self._next = self._next[:_AT_ONCE], self._next[_AT_ONCE:]
        figures = self._screen.figures(self._settings[rows])
        self.refuse(figures)
        self._cost[rows] = self._goal.cost(figures)
        known = np.concatenate([self._known, rows[np.isfinite(self._cost[rows])]])
        self._known = known[np.argsort(self._cost[known], kind="stable")]
        for row, distance in self._around:
            self._drop_around(row, distance)

    def leave_out(self, row: int, distance: float) -> None:
        """Leave out all settings that are nearer than a distance to one, by its number."""
        self._around.append((row, distance))
        self._drop_around(row, distance)

    def _drop_around(self, row: int, distance: float) -> None:
        away = self._ranges.apart(self._settings[row], self._settings[self._known])
        self._known = self._known[away >= distance]


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
        few = goal.cost(screen.bounds(tried.reshape(-1, tried.shape[2]))).reshape(len(best), -1)
        hopeful = few < cost[:, None]
        if not hopeful.any():
            continue
        few[~hopeful] = np.inf
        few[hopeful] = goal.cost(screen.figures(tried[hopeful]))
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
