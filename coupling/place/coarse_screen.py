"""Figures of settings: of many at a few places of a path, of the best at all of them."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from coupling.place.objective import PlaceDemands
from coupling.place.screen import Screen, ScreenFigures
from coupling.place.settings import Ranges
from coupling.place.station_choice import extremes_of, select_places
from coupling.place.stations import Stations

# What the few places may miss of a largest value, as a part of its range along the path.
_MISSED_PART = 0.03


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
            report: Called with the number of settings done.
        """
        return self._screen.figures(settings, report)

    def confirmed(self, settings: np.ndarray) -> ScreenFigures:
        """Return the figures of settings along the path; places of new extremes join the few.

        Args:
            settings: By `NAMES` [m], [rad], (n, 9), a few.
        """
        batch = self._whole.batch(settings)
        figures = self._whole.worst(batch)
        # A demand that is broken at all is seen at the place that breaks it.
        missed = np.where(self._demands.admits(figures), _MISSED_PART, 0.0)
        stations = np.union1d(self._few, extremes_of(batch, self._few, missed))
        if len(stations) > len(self._few):
            self._few, self._screen = stations, self._screen_of(self._every.chosen(stations))
        return figures
