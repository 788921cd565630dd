"""Figures of a case's cut, and what is out of what is usual or beyond the spindle."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from coupling.case.case import Case
from coupling.process.cut_course import CutCourse
from coupling.process.cutting_data import MATERIALS, CuttingData
from coupling.process.engaged_arcs import Arcs, StatedArcs
from coupling.process.milling_force import Milling, MillingForce
from coupling.process.milling_table import MillingForceTable
from coupling.results.cut_result import COURSES, CutExtremes, CutResult

# Points of a course that is stored.
_POINTS = 400
# Stated engagement and what the path meets differ by more than this part of the section.
_OTHERWISE, _SHARE = 0.1, 0.1
# Shear in steel and titanium, by tangential coefficient [Pa], and their highest usual speeds [m/s].
_HARD, _HARD_FASTEST, _FASTEST = 1.4e9, 10.0, 80.0
_SLOWEST = 0.1
# Part of the volume that the end of a cutter may remove without a word.
_BY_END = 0.2


def milling_and_table(case: Case) -> tuple[Milling, MillingForceTable] | None:
    """Return the cut of a case and its table; None where nothing is milled."""
    table = case.process_table
    if not isinstance(table, MillingForceTable):
        return None
    process = case.process if isinstance(case.process, MillingForce) else table.process(case.task)
    return process.milling, table


def cut_result(case: Case) -> CutResult | None:
    """Return the figures of a case's cut along its desired path; None where nothing is milled."""
    both = milling_and_table(case)
    if both is None:
        return None
    milling, table = both
    course = CutCourse.of(milling)
    cuts, time = course.cuts, course.time
    if not cuts.any():
        return None
    by_key = {
        "depth_m": course.depth,
        "width_m": course.width,
        "feed_per_tooth_m": course.feed_per_tooth,
        "mean_chip_m": course.mean_chip,
        "peak_chip_m": course.peak_chip,
        "removal_rate_m3_s": course.removal_rate,
        "torque_Nm": course.torque,
        "power_W": course.power,
    }
    steps = np.gradient(time)
    rows = np.unique(np.linspace(0, len(time) - 1, _POINTS).astype(int))
    limits = {
        "torque_Nm": table.spindle_torque_Nm,
        "power_W": table.spindle_power_W,
        "rpm": table.spindle_max_rpm,
    }
    return CutResult(
        rpm=course.speed * 30.0 / np.pi,
        cutting_speed_m_s=course.cutting_speed,
        cutting_time_s=float(steps[cuts].sum()),
        volume_m3=float(np.trapezoid(course.removal_rate, time)),
        by_end_m3=float(np.trapezoid(course.end_rate, time)),
        end_thrust_N=float(course.thrust.max()),
        force_N=float(course.force.max()),
        figures={
            key: CutExtremes(
                mean=float(np.average(values[cuts], weights=steps[cuts])),
                largest=float(values.max()),
                time_s=float(time[np.argmax(values)]),
            )
            for key, values in by_key.items()
        },
        limits={key: limit for key, limit in limits.items() if limit is not None},
        time_s=tuple(time[rows].tolist()),
        course={key: tuple(by_key[key][rows].tolist()) for key in COURSES},
    )


def cut_warnings(case: Case, cut: CutResult) -> Iterator[str]:
    """Yield a sentence for what is beyond the spindle, unusual for the material, or otherwise stated."""
    for key, limit in cut.limits.items():
        title, unit, scale = COURSES.get(key, ("speed of the spindle", "1/min", 1.0))
        largest = cut.rpm if key == "rpm" else cut.figures[key].largest
        if largest > limit:
            at = "" if key == "rpm" else f" (t = {cut.figures[key].time_s:.2f} s)"
            yield (
                f"process: {title}: expected at most {scale * limit:.4g} {unit}, as the spindle has it,"
                f" got {scale * largest:.4g} {unit}{at}: lower feed or depth"
            )
    both = milling_and_table(case)
    if both is None:
        return
    milling, table = both
    yield from _of_cutting_speed(
        cut.cutting_speed_m_s, milling.coefficients.K_tc, table.cutting_data
    )
    if isinstance(milling.engaged, StatedArcs):
        yield from _of_stated_arcs(milling, milling.engaged, table)
    if table.end_edge_m is None and cut.by_end_m3 > _BY_END * cut.volume_m3:
        share, removed = cut.by_end_m3 / cut.volume_m3, cut.volume_m3
        yield (
            f"process: {100.0 * share:.0f} % of the {1e9 * removed:.4g} mm3 that the path removes are"
            " cut by the end of the cutter, where it goes down into the material: no force, torque or"
            f" power has that share. If the end's edges reach its middle, up to {cut.end_thrust_N:.3g} N"
            f" press it upwards there, beside {cut.force_N:.3g} N at the side: state end_edge_m, their"
            " length from the rim inwards, 0 if they stay off the floor"
        )


def _of_cutting_speed(speed: float, tangential: float, data: CuttingData | None) -> Iterator[str]:
    """Yield a sentence where a cutting speed [m/s] is unusual for a material."""
    low, high = _SLOWEST, _HARD_FASTEST if tangential > _HARD else _FASTEST
    what = f"a material of K_tc = {1e-6 * tangential:.0f} MPa"
    if data is not None:
        (low, high), what = data.speeds, data.title
    if not low <= speed <= high:
        yield (
            f"process: cutting speed: expected {60.0 * low:.0f} to {60.0 * high:.0f} m/min for {what},"
            f" got {60.0 * speed:.0f} m/min: look at cutter_diameter_m and the spindle's speed"
        )


def _of_stated_arcs(
    milling: Milling, engaged: StatedArcs, table: MillingForceTable
) -> Iterator[str]:
    """Yield a sentence where a stated engagement is not what the path meets of its stock."""
    time = milling.desired.time
    stated = engaged.at(time)
    # Raw stock on the side that is stated is not known: only what the path removes twice is.
    met = engaged.removed.at(time)
    radius = milling.cutter.radius
    removes, assumed = met.section(radius), stated.section(radius)
    if table.engagement in ("up", "down"):
        removes = np.minimum(removes, assumed.max(initial=0.0))
    cuts = assumed > 0.0
    differs = cuts & (np.abs(removes - assumed) > _OTHERWISE * np.maximum(assumed, removes))
    share = float(differs.sum() / max(int(cuts.sum()), 1))
    if share > _SHARE:
        worst = int(np.argmax(np.where(differs, np.abs(removes - assumed), -1.0)))
        yield (
            f"process: engagement: stated as {table.engagement}, but over {100.0 * share:.0f} % of the"
            " cut the path meets another section of the stock that it removes, as at t ="
            f" {time[worst]:.2f} s: {_in_words(met, worst)} instead of {_in_words(stated, worst)}: take"
            ' engagement out, which is "stock" then, or describe the raw stock in stock_m'
        )


def _in_words(arcs: Arcs, row: int) -> str:
    """Return the arcs at a place by its number: "0 to 180 deg, 3 mm"."""
    words = [
        f"{np.rad2deg(start):.0f} to {np.rad2deg(end):.0f} deg, {1e3 * depth:.2g} mm"
        for start, end, depth, cut in zip(
            arcs.start[row], arcs.end[row], arcs.depth[row], arcs.is_cut[row], strict=True
        )
        if cut
    ]
    return " and ".join(words) or "nothing"


def material_remark(case: Case) -> Iterator[str]:
    """Yield where the coefficients of a named material come from."""
    table = case.process_table
    if isinstance(table, MillingForceTable) and table.material is not None:
        data = MATERIALS[table.material]
        low, high = (1e-6 * value for value in data.spread)
        yield (
            f"process: material: {data.title} by {data.source}, K_tc {low:.0f} to {high:.0f} MPa by"
            " source and tool: measure yours (elastic-robot identify cutting.csv)"
        )
