"""Maps over the part's position, with tool and base held as they are."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from coupling.place.coarse_screen import CoarseScreen
from coupling.place.objective import PlaceObjective
from coupling.place.settings import LENGTHS, NAMES, Ranges
from coupling.results.placement_result import MapAxes

# Points along the longer side of a map, at least and at most.
_MIN_POINTS, _MAX_POINTS = 9, 41
# Planes that are drawn where both of their axes are free.
_PLANES = (("x", "z"), ("x", "y"), ("y", "z"))


@dataclass(frozen=True)
class PartMap:
    """Figures of the part's positions in a plane.

    Attributes:
        first, second: Values along both axes [m], (a,) and (b,).
        deviation: Displacement of the tool by the process [m], (b, a); NaN where the part cannot be.
        exposure: Error of the tool at rest by what is not known of gears [m], (b, a); NaN there as well.
        changing: Number of gears with backlash whose torque changes sign, (b, a).
    """

    axes: MapAxes
    first: np.ndarray
    second: np.ndarray
    deviation: np.ndarray
    exposure: np.ndarray
    changing: np.ndarray


def part_maps(
    screen: CoarseScreen,
    ranges: Ranges,
    goal: PlaceObjective,
    name: str,
    setting: np.ndarray,
    points: int,
) -> list[PartMap]:
    """Return maps through a setting, in planes in which the part is free, two at most.

    Args:
        setting: The setting by `NAMES` [m], [rad], (9,).
        points: About the number of points of a map.
    """
    longer = int(np.clip(np.sqrt(points), _MIN_POINTS, _MAX_POINTS))
    free = {NAMES[k] for k in ranges.free} & set(LENGTHS)
    planes = [plane for plane in _PLANES if set(plane) <= free][:2]
    return [_map(screen, ranges, goal, name, setting, plane, longer) for plane in planes]


def _map(
    screen: CoarseScreen,
    ranges: Ranges,
    goal: PlaceObjective,
    name: str,
    setting: np.ndarray,
    plane: tuple[str, str],
    longer: int,
) -> PartMap:
    columns = [NAMES.index(axis) for axis in plane]
    step = ranges.width[columns].max() / (longer - 1)
    first, second = (
        np.linspace(ranges.low[k], ranges.high[k], max(5, round(float(ranges.width[k] / step)) + 1))
        for k in columns
    )
    grid = np.meshgrid(first, second)
    settings = np.tile(setting, (grid[0].size, 1))
    for k, values in zip(columns, grid, strict=True):
        settings[:, k] = values.ravel()
    figures = screen.figures(settings)
    admitted = goal.demands.admits(figures)

    def drawn(values: np.ndarray) -> np.ndarray:
        return np.where(admitted, values, np.nan).reshape(grid[0].shape)

    changing = np.sum((figures.margin < 0.0) & (figures.backlash_error > 0.0), axis=1)
    return PartMap(
        MapAxes(setting=name, across=plane[0], up=plane[1], shape=(len(second), len(first))),
        first,
        second,
        drawn(goal.deviation(figures)),
        drawn(goal.demands.exposure(figures)),
        drawn(changing.astype(float)),
    )
