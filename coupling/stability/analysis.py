"""elastic-robot stability: the cuts of a case along its path, or one cut in a posture, as figures."""

from __future__ import annotations

from functools import partial

import numpy as np

import elastic_robot
from coupling.errors import StabilityError
from coupling.events import Progress, Watch, unwatched
from coupling.modes.swinging_robot import swinging_robot
from coupling.results.stability_result import MarchResult, StabilityPoint, StabilityResult
from coupling.stability.case_cut import CaseCuts, PlacedCut
from coupling.stability.chart import feed_chart, part_chart, sensitivities, speed_chart
from coupling.stability.judgement import Judgement, Report
from coupling.stability.marching import march
from coupling.stability.path_stability import PLACES, PathStability

# A chart that begins so much above the lowest speed leaves speeds out.
_SLOWER = 1.001


def stability_in_posture(
    cuts: CaseCuts, placed: PlacedCut, watch: Watch = unwatched, seconds: float = 0.0
) -> StabilityResult:
    """Return the figures of one cut.

    Args:
        watch: Function called with the progress of the work.
        seconds: Time to march it [s]; 0: not at all.

    Raises:
        StabilityError: If the robot has no equilibrium there, or the cut cannot be marched.
    """
    path = PathStability((Judgement.of(cuts, placed),))
    more: dict[str, object] = {"remarks": (*cuts.beyond_limits(placed.q), *_undamped(path))}
    report = _reports(watch)
    if seconds:
        more["march"] = _march(path.worst, seconds, report)
    return _result(cuts, path, report).model_copy(update=more)


def stability_along_path(
    cuts: CaseCuts, watch: Watch = unwatched, seconds: float = 0.0
) -> StabilityResult:
    """Return the figures of a case's cuts along its path, with charts at the worst place.

    Args:
        watch: Function called with the progress of the work.
        seconds: Time to march the worst cut [s]; 0: not at all.

    Raises:
        PlanningError: If the robot cannot follow the path.
        StabilityError: If it never cuts, or the robot has no equilibrium at a place.
    """
    report = _reports(watch)
    path = PathStability.of(cuts, PLACES)
    if path is None:
        raise StabilityError(
            f"{cuts.case.name}: expected a tool path that cuts, got one that stays off the stock or"
            f" never feeds: lower it, or name a cut with --posture-deg"
        )
    for number, judgement in enumerate(path.judgements):
        report("limits along the path", number, len(path.judgements))
        _ = judgement.limit  # kept there
    worst = path.worst
    # Before all charts: it may be refused.
    marched = _march(worst, seconds, report) if seconds else None
    result = _result(cuts, path, report)
    chart = speed_chart(worst, report)
    over_feed, over_part = feed_chart(worst, report), part_chart(worst, report)
    robots = sensitivities(worst, report)
    report("limits of other robots", 1, 1)
    slowest = chart.rpm[0] if chart.rpm else np.inf
    remarks = _undamped(path)
    if slowest > _SLOWER * cuts.speeds[0]:
        too_slow = (
            f"speeds below {slowest:.0f} 1/min are too slow for the fastest mode, and left out"
        )
        remarks = (*remarks, too_slow)
    more: dict[str, object] = {
        "remarks": remarks,
        "stable_rpm": chart.stable_speeds(worst.placed.cut.depth),
        "chart": chart,
        "over_feed": over_feed,
        "over_part": over_part,
        "sensitivities": robots,
        "march": marched,
    }
    return result.model_copy(update=more)


def _undamped(path: PathStability) -> tuple[str, ...]:
    """Return a sentence where the robot has no damping."""
    if not path.worst.there.is_undamped:
        return ()
    robot = path.worst.cuts.case.robots[0].description.name
    return (
        f"the file of {robot} states no damping, with which the limit goes: give it under [[joint]], or"
        " [modal_damping]",
    )


def _reports(watch: Watch) -> Report:
    return lambda what, completed, total: watch(Progress(what, completed, total))


def _result(cuts: CaseCuts, path: PathStability, report: Report) -> StabilityResult:
    worst, placed = path.worst, cuts.case.robots[0]
    joints, tool_share = worst.shares(worst.at_limit)
    return StabilityResult(
        case=cuts.case.title,
        case_file=f"{cuts.case.name}.toml",
        robot=placed.description.name,
        tolerance_m=cuts.case.tolerance,
        sentence=path.sentence,
        tool_modes=len(cuts.tool),
        deepest_m=worst.deepest,
        points=tuple(_point(judgement) for judgement in path.judgements),
        worst=path.judgements.index(worst),
        joints=tuple(joints.tolist()),
        tool_share=tool_share,
        islands_m=tuple(worst.islands(report)),
        swinging=swinging_robot(
            placed.description,
            cuts.case.resolved[placed.table]["description"],
            worst.placed.q,
            worst.there.linear.modes,
            placed.world_from_base,
        ),
        version=elastic_robot.__version__,
    )


def _point(judgement: Judgement) -> StabilityPoint:
    placed, vibration = judgement.placed, judgement.vibration
    return StabilityPoint(
        time=placed.time,
        posture_deg=tuple(np.rad2deg(placed.q).round(9).tolist()),
        feed_deg=float(np.rad2deg(placed.feed)),
        rpm=placed.cut.rpm,
        depth_m=placed.cut.depth,
        stable=vibration.is_stable,
        growth_1_s=vibration.growth,
        frequency_Hz=vibration.frequency,
        border=vibration.border,
        limit_m=judgement.limit,
        zero_order_m=judgement.zero_order,
        unloaded_joints=judgement.there.unloaded,
        moved_m=judgement.displacement,
    )


def _march(judgement: Judgement, seconds: float, report: Report) -> MarchResult:
    placed, whole = judgement.placed, judgement.there.whole
    teeth = partial(report, "teeth in time")
    marched = march(whole, placed.cut, placed.feed_per_tooth, seconds, report=teeth)
    late = marched.out_of_cut[-max(1, len(marched.out_of_cut) // 10) :]
    return MarchResult(
        seconds=seconds,
        stable=marched.is_stable,
        growth_1_s=marched.growth,
        out_of_cut=float(late.mean()),
    )
