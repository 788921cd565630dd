"""Charts at a cut: over the speed of the spindle, the direction of the feed, the part, and the robot."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from coupling.errors import StabilityError
from coupling.modes.part_grid import PartGrid
from coupling.results.stability_result import (
    ChartResult,
    FeedChartResult,
    PartChartResult,
    SensitivityResult,
    stored_limits,
)
from coupling.stability.case_cut import CaseCuts, PlacedCut
from coupling.stability.floquet import vibration_of
from coupling.stability.judgement import Judgement, Report
from coupling.stability.limit import first_border
from coupling.stability.zero_order import ZeroOrder

# Speeds of a chart, directions of the feed, places along each side of the part's map.
_SPEEDS, _DIRECTIONS, _GRID = 100, 24, 9
# Factors of damping and stiffness of the robot's gears.
_DAMPING, _STIFFNESS = (0.5, 2.0), (0.75, 1.25)


def speed_chart(judgement: Judgement, report: Report) -> ChartResult:
    """Return the limits of a cut over the range of the spindle's speeds.

    Args:
        judgement: The cut.
        report: Called with what is done, and how much of it.
    """
    cuts, there, cut = judgement.cuts, judgement.there, judgement.placed.cut
    rpm = np.geomspace(*cuts.speeds, _SPEEDS)
    quick = ZeroOrder.of(there.whole, cut)
    alone = ZeroOrder.of(there.robot, cut) if len(there.robot.eigenvalue) else None
    limit, frequency = np.full(_SPEEDS, np.inf), np.full(_SPEEDS, np.nan)
    zero_order, robot_alone = np.full(_SPEEDS, np.inf), np.full(_SPEEDS, np.inf)
    for k, speed in enumerate(rpm.tolist()):
        report("limits over the speed", k, _SPEEDS)
        cut_there = cut.at_speed(speed)
        deepest = Judgement(cuts, replace(judgement.placed, cut=cut_there), there).deepest
        try:
            limit[k] = first_border(there.whole, cut_there, deepest, quick)
        except StabilityError:  # too slow for the fastest mode
            limit[k] = np.nan
        if limit[k] == np.inf and deepest < cuts.deepest:
            limit[k] = np.nan
        if np.isnan(limit[k]):
            continue
        zero_order[k] = quick.limit(cut_there.cutter.tooth_period)
        if alone is not None:
            robot_alone[k] = alone.limit(cut_there.cutter.tooth_period)
        if 0.0 < limit[k] < np.inf:
            frequency[k] = vibration_of(there.whole, cut_there.at_depth(float(limit[k]))).frequency
    is_known = ~np.isnan(limit)
    return ChartResult(
        rpm=tuple(rpm[is_known].tolist()),
        limit_m=stored_limits(limit[is_known]),
        frequency_Hz=stored_limits(frequency[is_known]),
        zero_order_m=stored_limits(zero_order[is_known]),
        robot_alone_m=stored_limits(robot_alone[is_known]),
    )


def feed_chart(judgement: Judgement, report: Report) -> FeedChartResult:
    """Return the limits of a cut with the feed turned to all directions."""
    placed, cuts = judgement.placed, judgement.cuts
    angles = np.linspace(0.0, 2.0 * np.pi, _DIRECTIONS, endpoint=False)
    limits = np.empty(_DIRECTIONS)
    for k, angle in enumerate(angles.tolist()):
        report("limits over the direction of the feed", k, _DIRECTIONS)
        limits[k] = Judgement.of(cuts, replace(placed, feed=angle)).limit
    return FeedChartResult(
        feed_deg=tuple(np.rad2deg(angles).tolist()), limit_m=stored_limits(limits)
    )


def part_chart(judgement: Judgement, report: Report) -> PartChartResult:
    """Return the limits of a cut at places about the path, at the programmed speed."""
    cuts, placed = judgement.cuts, judgement.placed
    robot = cuts.case.robots[0]
    in_base = robot.world_from_base.inverse()
    path, q = cuts.path_of_cuts
    grid = PartGrid.around(robot.description, in_base @ cuts.case.task.part, path, q, _GRID)
    limit = np.full(grid.q.shape[:2], np.nan)
    least = limit.copy()
    for number, (row, column) in enumerate(np.ndindex(*limit.shape)):
        report("limits over the part", number, limit.size)
        posture = grid.q[row, column]
        if np.isfinite(posture).all():
            limit[row, column], least[row, column] = _limits(cuts, replace(placed, q=posture))
    return PartChartResult(
        x_m=tuple(grid.x.tolist()),
        y_m=tuple(grid.y.tolist()),
        limit_m=tuple(map(stored_limits, limit)),
        least_m=tuple(map(stored_limits, least)),
    )


def _limits(cuts: CaseCuts, placed: PlacedCut) -> tuple[float, float]:
    """Return the limit of a cut and what no speed falls below [m]; NaN without equilibrium."""
    try:
        judgement = Judgement.of(cuts, placed)
    except StabilityError:
        return np.nan, np.nan
    return judgement.limit, judgement.least


def sensitivities(judgement: Judgement, report: Report) -> tuple[SensitivityResult, ...]:
    """Return how the limit moves with damping and stiffness of the robot's gears."""
    cuts, placed = judgement.cuts, judgement.placed
    differences = [("as in the robot file", 1.0, 1.0)]
    differences += [(f"damping x {factor:g}", factor, 1.0) for factor in _DAMPING]
    differences += [(f"stiffness x {factor:g}", 1.0, factor) for factor in _STIFFNESS]
    limits = []
    for number, (name, damping, stiffness) in enumerate(differences):
        report("limits of other robots", number, len(differences))
        other = Judgement(cuts, placed, cuts.structure(placed, damping, stiffness))
        limits.append(SensitivityResult(name=name, limit_m=other.limit, least_m=other.least))
    return tuple(limits)
