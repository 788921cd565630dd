"""elastic-robot place, from a case to its best settings."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from coupling.errors import BuildError, HostError, PlanningError, SimulationError
from coupling.events import Progress, Watch, unwatched
from coupling.place.coarse_screen import CoarseScreen
from coupling.place.evaluated_setting import EvaluatedSetting, ProcessOf, evaluate_setting
from coupling.place.part_map import PartMap, part_maps
from coupling.place.placing import Placing
from coupling.place.search import fill_box, refine_settings
from coupling.place.search_state import SearchState
from coupling.place.stations import Stations
from coupling.results.expected_deviation import ExpectedDeviation
from coupling.run.check import timed
from coupling.run.exact_command import expected_deviation

# Stages of the search, at whose end it is kept.
_LOOKED_AT, _REFINED = "the choice of its best settings", "their refinement"
# Settings this close are one, over the box.
_SAME_SETTING = 0.02
# Settings whose cuts are judged for each that is asked for.
_CANDIDATES = 5


@dataclass(frozen=True)
class CasePlacement:
    """The best settings of a case.

    Attributes:
        stations: Places of the path that many settings were looked at.
        refused: Number of those of the first look that were refused, by reason.
        present: The case as it is; None where its robot cannot follow its path.
        expected: Deviation to expect of a corrected command, as it is and in the best setting; None
            where it is not known.
        durations: Wall time by part [s].
    """

    placing: Placing
    stations: Stations
    looked_at: int
    refused: dict[str, int]
    present: EvaluatedSetting | None
    best: tuple[EvaluatedSetting, ...]
    expected: tuple[ExpectedDeviation | None, ExpectedDeviation | None]
    maps: tuple[PartMap, ...]
    durations: dict[str, float]


def place(
    placing: Placing,
    process_of: ProcessOf,
    watch: Watch = unwatched,
    state: SearchState | None = None,
) -> CasePlacement:
    """Return the best settings of a case.

    Args:
        state: File of the search for the next attempt; None: none.

    Raises:
        PlanningError: If no setting is admitted, or the robot cannot follow its path in any of the best.
    """
    durations: dict[str, float] = {}
    state = state or SearchState(None, placing)
    table, ranges, goal = placing.case.place, placing.ranges, placing.goal

    def reported(what: str) -> Callable[[int, int], None]:
        return lambda completed, total: watch(Progress(what, completed, total))

    with timed("selection", durations):
        watch(Progress("choosing samples of the path", 0, 1))
        screen = CoarseScreen(placing.screen, placing.stations, ranges, goal.demands, table.seed)
    with timed("search", durations):
        refined = state.read(_REFINED, screen, goal)
        settings = refined or state.read(_LOOKED_AT, screen, goal)
        if settings is None:
            report = reported("evaluating settings")
            settings = fill_box(screen, ranges, goal, table.settings, table.seed, report)
            state.write(_LOOKED_AT, screen, settings)
    with timed("last steps", durations):
        if refined is None:
            report = reported("refining the best settings")
            settings = refine_settings(screen, goal, ranges, settings, table.seed, report)
            state.write(_REFINED, screen, settings)
    if len(settings.settings) == 0:
        reasons = ", ".join(f"{what}: {count}" for what, count in settings.refused.items() if count)
        raise PlanningError(
            f"{placing.case.name}: expected a feasible setting, got none of {settings.looked_at}"
            f" ({reasons}): widen the ranges in [place], or require less margin"
        )
    with timed("whole path", durations):
        present = _present(placing, process_of)
        best = best_of(placing, settings.settings, process_of, watch)
    with timed("expected deviation", durations):
        watch(Progress("simulating robots to expect", 0, 1))
        expected = _expected(placing, present), _expected(placing, best[0])
    with timed("maps", durations):
        shown = [("present", placing.present), ("best", best[0].setting)]
        maps = []
        for k, (name, setting) in enumerate(shown):
            watch(Progress("drawing maps", k, len(shown)))
            maps += part_maps(screen, ranges, goal, name, setting, table.settings // 4)
    return CasePlacement(
        placing,
        screen.stations,
        settings.looked_at,
        settings.refused,
        present,
        best,
        expected,
        tuple(maps),
        durations,
    )


def best_of(
    placing: Placing, settings: np.ndarray, process_of: ProcessOf, watch: Watch = unwatched
) -> tuple[EvaluatedSetting, ...]:
    """Return the best settings that the robot can follow its path in, as many as are asked for.

    Args:
        settings: Settings by `NAMES` [m], [rad], the best first, (n, 9).

    Raises:
        PlanningError: If there is none.
    """
    count, settings_found, reasons = placing.case.place.cases, [], []
    by_stability = placing.goal.objective == "stability"
    tried = _CANDIDATES * count if by_stability else count
    for k, setting in enumerate(_distinct(placing, settings)):
        watch(Progress("evaluating the best along the whole path", k, len(settings)))
        try:
            evaluated = evaluate_setting(placing, setting, process_of)
        except PlanningError as error:
            reasons.append(str(error))
            continue
        if np.isfinite(evaluated.result.cost_m):
            settings_found.append(evaluated)
        else:
            reasons += evaluated.refusals
        if len(settings_found) == tried:
            break
    if not settings_found:
        raise PlanningError(
            f"{placing.case.name}: expected a setting in which the robot can follow the whole path, got"
            f" none: {reasons[0]}"
        )
    if by_stability:
        settings_found.sort(key=lambda setting: (setting.depth_over_limit, setting.result.cost_m))
        return tuple(settings_found[:count])
    return tuple(sorted(settings_found, key=lambda setting: setting.result.cost_m))


def _distinct(placing: Placing, settings: np.ndarray) -> list[np.ndarray]:
    """Return settings as they can be written, without those that came to the same."""
    chosen: list[np.ndarray] = []
    for setting in placing.ranges.rounded(settings):
        if not chosen or placing.ranges.apart(setting, np.array(chosen)).min() > _SAME_SETTING:
            chosen.append(setting)
    return chosen


def _expected(placing: Placing, setting: EvaluatedSetting | None) -> ExpectedDeviation | None:
    """Return the deviation to expect in a setting; None where it cannot be simulated."""
    if setting is None:
        return None
    factors = placing.case.process_table.FORCE_FACTORS
    try:
        return expected_deviation(setting.placed, factors, setting.motion)
    except (BuildError, HostError, SimulationError):
        return None


def _present(placing: Placing, process_of: ProcessOf) -> EvaluatedSetting | None:
    try:
        return evaluate_setting(placing, placing.present, process_of)
    except PlanningError:
        return None
