"""The folder of a placement: case files of the best settings, figures, maps."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

import numpy as np

import elastic_robot
from coupling.errors import ResultError
from coupling.files.atomic_file import writing
from coupling.files.csv_table import read_table, write_table
from coupling.files.written_files import claim_file
from coupling.place.evaluated_setting import EvaluatedSetting
from coupling.place.part_map import PartMap
from coupling.place.place import CasePlacement
from coupling.place.placing import setting_keys
from coupling.place.settings import NAMES
from coupling.results.base import Shown
from coupling.results.expected_deviation import ExpectedDeviation
from coupling.results.placement_result import MapAxes, PlacementResult, SettingResult

FIGURES, MAP = "place.json", "map.csv"
_MAP_COLUMNS = ("map", "across_m", "up_m", "admitted", "moved_m", "exposure_m", "changing")


def placed_file(number: int) -> str:
    """Return the name of the case file of a setting, the best being number 1."""
    return f"placed_{number}.toml"


def write_placement(folder: Path, placement: CasePlacement) -> None:
    """Write all files but the report into an existing folder."""
    case = placement.placing.case.title
    with writing(folder, ResultError):
        for number, setting in enumerate(placement.best, start=1):
            head = (
                f"# {case}, placed by elastic-robot place: number {number} of the best settings\n\n"
            )
            claim_file(folder / placed_file(number)).write_text(
                head + setting.content, encoding="utf-8"
            )
        claim_file(folder / FIGURES).write_text(figures_of(placement).text(), encoding="utf-8")
        if placement.maps:
            rows = [_rows(number, setting) for number, setting in enumerate(placement.maps)]
            write_table(claim_file(folder / MAP), _MAP_COLUMNS, np.vstack(rows))


def _rows(number: int, part_map: PartMap) -> np.ndarray:
    across, up = np.meshgrid(part_map.first, part_map.second)
    admitted = np.isfinite(part_map.deviation)
    values = [
        np.where(admitted, v, 0.0)
        for v in (part_map.deviation, part_map.exposure, part_map.changing)
    ]
    columns = (np.full(across.shape, number), across, up, admitted, *values)
    return np.column_stack([column.ravel() for column in columns])


def figures_of(placement: CasePlacement) -> PlacementResult:
    """Return the figures of a placement."""
    placing, ranges = placement.placing, placement.placing.ranges
    low, high = setting_keys(ranges.low), setting_keys(ranges.high)
    goal, present = placing.goal, placement.present
    return PlacementResult(
        case=placing.case.title,
        robot=placing.robot.name,
        tolerance_m=placing.case.tolerance,
        optimise=goal.objective,
        forced=goal.forced,
        demands=goal.demands,
        limited_joints=sum(joint.limits is not None for joint in placing.robot.joints),
        ranges={key: (low[key], high[key]) for key in low},
        free=tuple(NAMES[k] for k in ranges.free),
        places_s=tuple(placement.stations.time.tolist()),
        settings=placement.looked_at,
        filling=placing.case.place.settings,
        refused=placement.refused,
        present_setting=setting_keys(placing.present),
        present=None if present is None else _expecting(present, placement.expected[0]),
        best=tuple(
            _expecting(evaluated, placement.expected[1] if number == 1 else None, number)
            for number, evaluated in enumerate(placement.best, start=1)
        ),
        maps=tuple(part_map.axes for part_map in placement.maps),
        version=elastic_robot.__version__,
    )


def _expecting(
    evaluated: EvaluatedSetting, expected: ExpectedDeviation | None, number: int | None = None
) -> SettingResult:
    """Return the figures of a setting with what is expected in it, and its case file by its number."""
    file = None if number is None else placed_file(number)
    return evaluated.result.model_copy(update={"file": file, "expected": expected})


@dataclass(frozen=True)
class StoredPlacement(Shown):
    """A placement read back from its folder."""

    folder: Path
    figures: PlacementResult
    maps: tuple[PartMap, ...]


def read_placement(folder: Path) -> StoredPlacement:
    """Read the folder of a placement.

    Raises:
        ResultError: If a file is missing or broken.
    """
    figures = PlacementResult.read(folder / FIGURES, ResultError)
    if not figures.maps:
        return StoredPlacement(folder, figures, ())
    table = read_table(folder / MAP, _MAP_COLUMNS, ResultError)
    try:
        maps = [
            _read_map(axes, table[table[:, 0] == number])
            for number, axes in enumerate(figures.maps)
        ]
    except ValueError as cause:
        raise ResultError(f"{folder / MAP}: expected the maps of {FIGURES}: {cause}") from cause
    return StoredPlacement(folder, figures, tuple(maps))


def _read_map(axes: MapAxes, rows: np.ndarray) -> PartMap:
    across, up, admitted, *values = (column.reshape(axes.shape) for column in rows[:, 1:].T)
    drawn = (np.where(admitted > 0.0, v, np.nan) for v in values)
    return PartMap(axes, across[0], up[:, 0], *drawn)
