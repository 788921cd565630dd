"""The places of a path that a screen has to look at: those at which something is largest or smallest."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from coupling.place.screen import Lanes, Screen
from coupling.place.settings import Ranges
from coupling.place.stations import Stations

# Settings in which all places are looked at.
_TRIED, _USED = 128, 96
# Places that are chosen.
PLACES = 24
# How much what is missed of the largest displacement counts, and of the largest angle: a setting is
# worth what its displacement is, but only has to stay clear of limits.
_MOVED, _ANGLES = 4.0, 0.3


def selected(
    screen_of: Callable[[Stations], Screen], stations: Stations, ranges: Ranges, seed: int
) -> Stations:
    """Return the places at which torques, angles and displacements are extreme in sampled settings.

    Greedily, each place is that which makes the sum of squares of what the extremes of those chosen
    miss of all, relative to their ranges, smallest.

    Args:
        screen_of: Function that looks at places.
        stations: All places.
        ranges: Settings to sample.
        seed: Of the sample.
    """
    strongest = stations.strongest()
    if strongest.count <= PLACES:
        return strongest
    few = strongest.chosen(np.linspace(0, strongest.count - 1, PLACES).astype(int))
    tried = ranges.sampled(_TRIED, seed)
    good = tried[screen_of(few).figures(tried).reached][:_USED]
    if len(good) == 0:
        return few
    rows = _rows(screen_of(strongest).lanes(good))
    if rows.shape[0] == 0:
        return few
    return strongest.chosen(np.sort(_greedy(rows, PLACES)))


def with_extremes(
    screen_of: Callable[[Stations], Screen],
    chosen: Stations,
    stations: Stations,
    settings: np.ndarray,
) -> Stations:
    """Return chosen places and those at which some settings have their own extremes.

    Args:
        screen_of: Function that looks at places.
        chosen: Places of the path.
        stations: All places.
        settings: The settings, (n, 8).
    """
    strongest = stations.strongest()
    rows = _rows(screen_of(strongest).lanes(settings))
    known = np.flatnonzero(np.isin(strongest.time, chosen.time))
    return strongest.chosen(np.union1d(known, rows.argmax(axis=1)))


def _rows(lanes: Lanes) -> np.ndarray:
    """Return quantities whose largest values count, as parts of their ranges, (quantities, k)."""
    places = len(lanes.q)
    angles = np.concatenate([lanes.q, lanes.rate], axis=1).transpose(1, 2, 0).reshape(-1, places)
    torque = lanes.torque.transpose(1, 2, 0).reshape(-1, places)
    return np.concatenate(
        [
            _MOVED * _parts(lanes.deviation.T),
            *(_parts(sign * torque) for sign in (1.0, -1.0)),
            *(_ANGLES * _parts(sign * angles) for sign in (1.0, -1.0)),
            _ANGLES * _parts(-lanes.regularity.T),
        ]
    )


def _parts(rows: np.ndarray) -> np.ndarray:
    """Return what changes along the path over its range, (quantities, k)."""
    rows = rows[np.isfinite(rows).all(axis=1)]
    width = np.ptp(rows, axis=1)
    moving = width > 1e-12 * np.abs(rows).max(axis=1, initial=1e-300)
    scaled: np.ndarray = rows[moving] / width[moving, None]
    return scaled


def _greedy(rows: np.ndarray, count: int) -> np.ndarray:
    """Return columns whose largest entries come close to those of all."""
    short = rows.max(axis=1, keepdims=True) - rows  # what a column misses of each row's largest
    missing = np.ones((len(rows), 1))
    chosen: list[int] = []
    for _ in range(count):
        left = np.minimum(missing, short)
        best = int(np.argmin((left**2).sum(axis=0)))
        chosen.append(best)
        missing = left[:, [best]]
    return np.unique(chosen)
