"""Figures of settings: of many at a few places of a path, of the best at all of them."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from coupling.place.objective import PlaceDemands
from coupling.place.screen import Batch, Screen, ScreenFigures
from coupling.place.settings import Ranges
from coupling.place.stations import Stations

# What the few places may miss of a largest value, as a part of its range along the path.
_MISSED_PART = 0.03
# Settings in which all places are looked at.
_SETTING_COUNT, _KEPT_SETTINGS = 128, 96
# Places that are chosen.
PLACES = 24
# How much what is missed of the largest displacement counts, and of the largest angle: a setting is
# worth what its displacement is, but only has to stay clear of limits.
_DISPLACEMENT_WEIGHT, _ANGLE_WEIGHT = 4.0, 0.3


class CoarseScreen:
    """Screen at a few places of a path, which are added to as they turn out to be needed.

    The best of a box lie on the edges of what is admitted, and an edge that a few places draw is not
    that of the path: between them a posture is more singular, a torque larger.  So whatever is to be
    kept is looked at along the whole path, and extremes of it that were not known are from then on
    (Blankenship and Falk, "Infinitely constrained optimization problems", JOTA 19 (1976) 261-281).

    Args:
        ranges: Settings that the first few places are chosen for.
    """

    def __init__(
        self,
        screen_of: Callable[[Stations], Screen],
        stations: Stations,
        ranges: Ranges,
        demands: PlaceDemands,
        seed: int,
    ) -> None:
        self._screen_of, self._demands = screen_of, demands
        self._every = stations.strongest()
        self._few = select_places(screen_of, self._every, ranges, seed)
        self._whole, self._screen = screen_of(self._every), screen_of(self._every.chosen(self._few))

    @property
    def stations(self) -> Stations:
        """The few places."""
        return self._screen.stations

    def figures(
        self, settings: np.ndarray, report: Callable[[int], None] = lambda completed: None
    ) -> ScreenFigures:
        """Return the figures of settings at the few places.

        Args:
            settings: By `NAMES` [m], [rad], (n, 9).
        """
        return self._screen.figures(settings, report)

    def bounds(
        self, settings: np.ndarray, report: Callable[[int], None] = lambda completed: None
    ) -> ScreenFigures:
        """Return the figures of settings at three of the few places, none worse than at all of them.

        Args:
            settings: By `NAMES` [m], [rad], (n, 9).
        """
        return self._screen.bounds(settings, report)

    def confirmed(self, settings: np.ndarray) -> ScreenFigures:
        """Return the figures of settings along the path; places of new extremes join the few.

        Args:
            settings: By `NAMES` [m], [rad], (n, 9), a few.
        """
        batch = self._whole.batch(settings)
        figures = self._whole.worst(batch)
        # A demand that is broken at all is seen at the place that breaks it.
        missed = np.where(self._demands.admits(figures), _MISSED_PART, 0.0)
        self.add_places(extremes_of(batch, self._few, missed))
        return figures

    @property
    def places(self) -> np.ndarray:
        """Numbers of the few places, (k,)."""
        return self._few

    def add_places(self, places: np.ndarray) -> None:
        """Let places join the few, by their numbers, (p,)."""
        stations = np.union1d(self._few, places)
        if len(stations) > len(self._few):
            self._few, self._screen = stations, self._screen_of(self._every.chosen(stations))


def select_places(
    screen_of: Callable[[Stations], Screen], stations: Stations, ranges: Ranges, seed: int
) -> np.ndarray:
    """Return the numbers of places with extreme torques, angles and displacements in samples, (k,).

    Greedily, each place is that which makes the sum of squares of what the extremes of those chosen
    miss of all, relative to their ranges, smallest.
    """
    if stations.count <= PLACES:
        return np.arange(stations.count)
    few = np.linspace(0, stations.count - 1, PLACES).astype(int)
    tried = ranges.sampled(_SETTING_COUNT, seed)
    good = tried[screen_of(stations.chosen(few)).figures(tried).reached][:_KEPT_SETTINGS]
    if len(good) == 0:
        return few
    rows, _ = _rows(screen_of(stations).batch(good))
    if rows.shape[0] == 0:
        return few
    return _greedy(rows, PLACES)


def extremes_of(batch: Batch, stations: np.ndarray, missed: np.ndarray) -> np.ndarray:
    """Return the numbers of places at which settings have extremes that known places miss, (k,).

    Args:
        stations: Numbers of the known places, (p,).
        missed: Share of its range along the path by which an extreme may be missed, by setting, (n,).
    """
    rows, setting = _rows(batch)
    known_largest = rows[:, stations].max(axis=1, initial=-np.inf)
    further = rows.max(axis=1, initial=-np.inf) > known_largest + missed[setting]
    return np.unique(rows[further].argmax(axis=1))


def _rows(batch: Batch) -> tuple[np.ndarray, np.ndarray]:
    """Return quantities whose largest values count, as parts of their ranges, and whose they are.

    Returns:
        Quantities by rows, (r, k), and the number of the setting of each, (r,).
    """
    angles = np.concatenate([batch.q, batch.rate], axis=1)
    quantities = [
        _DISPLACEMENT_WEIGHT * _parts(batch.deviation[:, None]),
        *(_parts(sign * batch.torque) for sign in (1.0, -1.0)),
        *(_ANGLE_WEIGHT * _parts(sign * angles) for sign in (1.0, -1.0)),
        _ANGLE_WEIGHT * _parts(-batch.conditioning[:, None]),
    ]
    rows = np.concatenate(
        [quantity.transpose(1, 2, 0).reshape(-1, len(quantity)) for quantity in quantities]
    )
    settings = np.arange(batch.q.shape[2])
    owner = np.concatenate([np.tile(settings, quantity.shape[1]) for quantity in quantities])
    finite = np.isfinite(rows).all(axis=1)
    return rows[finite], owner[finite]


def _parts(values: np.ndarray) -> np.ndarray:
    """Return values over their range along the path [1], (k, quantities, n); NaN where it is zero."""
    width = np.ptp(values, axis=0)
    moving = width > 1e-12 * np.abs(values).max(axis=0, initial=1e-300)
    parts: np.ndarray = values / np.where(moving, width, np.nan)
    return parts


def _greedy(rows: np.ndarray, count: int) -> np.ndarray:
    """Return columns whose largest entries come close to those of all."""
    short = rows.max(axis=1, keepdims=True) - rows  # what a column misses of each row's largest
    missing = np.ones((len(rows), 1))
    chosen: list[int] = []
    for _ in range(count):
        shortfall = np.minimum(missing, short)
        best = int(np.argmin((shortfall**2).sum(axis=0)))
        chosen.append(best)
        missing = shortfall[:, [best]]
    return np.unique(chosen)
