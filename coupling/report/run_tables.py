"""Sections of a run's figures."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from math import degrees, isnan
from typing import Any

from coupling.path.deviation import Deviation
from coupling.report.section import Note, Section, Table
from coupling.report.shares import BEHIND, DeviationShare, DeviationShares
from coupling.report.style import UM
from coupling.results.run_result import GearResult, RunResult
from coupling.solve.correction import HOW

# One step inwards, in no-break spaces.
_IN = "\u00a0\u00a0"
_MODES = {"dynamic": "moving robot", "quasistatic": "quasi-static robot"}


def mode_names(mode: str) -> tuple[str, str]:
    """Return what to call the robot in a run's mode and in the other one."""
    mode_name = _MODES[mode]
    return mode_name, next(name for name in _MODES.values() if name != mode_name)


def deviations(
    figures: RunResult,
    parts: Sequence[DeviationShares],
    robots: Sequence[tuple[str, Sequence[Deviation]]] = (),
) -> Section:
    """Return how far the tool is off, before and after, and why.

    Args:
        figures: Content of result.json.
        parts: Parts of the deviation for each of its stages; of a cell, the worst of its robots'.
        robots: Deviations of a cell's robots by their names.
    """
    shares, (mode, other_mode) = figures.shares_m, mode_names(figures.mode)
    whole, stages = figures.deviations, len(figures.stages)
    gravity = [shares.gravity, shares.gravity_after][:stages]
    process = [shares.process, shares.process_after][:stages]
    rows: list[tuple[str, Sequence[Any]]] = [
        (f"{mode}, {HOW[figures.before]}" if stages == 1 else mode, whole),
        (f"{_IN}less a constant", [_less_constant(deviation) for deviation in whole]),
        (f"{_IN}gravity alone", gravity),
        (f"{_IN}{_IN}less a constant", [_less_constant(deviation) for deviation in gravity]),
        (f"{_IN}process (loaded minus unloaded)", process),
        (f"{_IN}motion (moving minus quasi-static)", [part.motion for part in parts]),
        (
            f"{_IN}while gears are in their backlash, and {BEHIND:g} s behind",
            [part.flanks for part in parts],
        ),
        (f"{_IN}at all other times", [part.elsewhere for part in parts]),
        (f"{other_mode} under the same command and wrench", [part.other for part in parts]),
        *((f"{name} robot", deviation) for name, deviation in robots),
    ]
    columns = ("max", "rms", "at t = [s]")
    filled = [(name, [_figures_of(cell) for cell in cells]) for name, cells in rows]
    deviation = Table(
        ("deviation [um]", *columns * stages),
        [(name, *sum(cells, ())) for name, cells in filled if any(map(any, cells))],
        "dense",
        [("", 1), *((stage, len(columns)) for stage in figures.stages)],
    )
    if figures.kind == "couple":
        return Section("", (deviation, *_of_tooth_passing(figures)))
    how = (
        f"Before compensation: {HOW[figures.before]}. After compensation: with the process on the tool's"
        " actual path."
    )
    return Section("", (how, deviation, _SHARES, *_of_tooth_passing(figures)))


_SHARES = Note(
    "Gravity alone, after compensation: deviation under the corrected command without the process. The"
    " shares do not add up, as their directions differ. Less a constant: after subtraction of the mean"
    " deviation, which a shift of the part can remove."
)


def _less_constant(deviation: Deviation | None) -> tuple[str, ...] | None:
    """Return max and rms of a deviation less a constant [um]; None in a run of an earlier version."""
    if deviation is None or isnan(deviation.maximum_less_constant):
        return None
    return (
        f"{UM * deviation.maximum_less_constant:.2f}",
        f"{UM * deviation.rms_less_constant:.2f}",
        "",
    )


def _figures_of(deviation: Deviation | DeviationShare | tuple[str, ...] | None) -> tuple[str, ...]:
    """Return largest, rms and instant of a deviation [um], [s]."""
    if deviation is None:
        return ("", "", "")
    if isinstance(deviation, tuple):
        return deviation
    time = deviation.time if isinstance(deviation, DeviationShare) else deviation.time_of_maximum
    return (f"{UM * deviation.maximum:.2f}", f"{UM * deviation.rms:.2f}", f"{time:.3f}")


def _of_tooth_passing(figures: RunResult) -> list[str]:
    """Return what a periodic process leaves, in parts."""
    tooth_passing = figures.tooth_passing
    if tooth_passing is None:
        return []
    walls = ", ".join(
        f"{axis} {UM * low:.2f} to {UM * high:.2f}"
        for axis, (low, high) in tooth_passing.envelope_m.items()
    )
    return [
        f"Tooth passing: {1e3 * tooth_passing.period_s:.3g} ms. The mean of the last deviation over a"
        f" tooth passing is at most {UM * tooth_passing.slow_m:.2f} um, the ripple about it"
        f" {UM * tooth_passing.ripple_m:.2f} um. A surface cut at the extremes of each tooth passing"
        f" deviates by {walls} um, base axes."
    ]


def robustness(figures: RunResult) -> list[Section]:
    """Return what the command leaves on robots that differ from the model."""
    if not figures.robustness:
        return []
    text = (
        "Deviation under the command as written and under the same wrench, on dynamic robots of"
        " which one parameter differs from the model, in all gears and tilts or in all motors:"
    )
    rows = [(row.name, row.deviation_m) for row in figures.robustness]
    return [Section("On robots that differ from the model", (text, _of_deviations(rows)))]


def plant(figures: RunResult) -> list[Section]:
    """Return what the command leaves on the plant beside the model."""
    plant_result = figures.plant
    if plant_result is None:
        return []
    differences = ", ".join(plant_result.differences) or "nothing"
    text = f"The same command on a robot that differs from the model by: {differences}. "
    text += (
        "The wrench is that on the model, times the factor of the force."
        if plant_result.coupling is None
        else f"The process was evaluated on the plant's path: {plant_result.coupling.reason}."
    )
    warning = [f"Warning: {plant_result.remark}."] if plant_result.remark else []
    model, mode = figures.shares_m.dynamic_after, "dynamic"
    if model is None:  # a coupling corrects nothing
        model, mode = figures.deviation_before_m, figures.mode
    rows = [(f"{mode} model", model), ("dynamic plant", plant_result.deviation_m)]
    return [Section("On the plant", (text, *warning, _of_deviations(rows)))]


def passages(figures: RunResult) -> list[Section]:
    """Return how often which gear passes through its backlash, and what a wrong one leaves."""
    if not figures.reversals:
        return []
    several, rows = len(figures.robots) > 1, []
    for robot, joint in sorted({(change.robot, change.joint) for change in figures.reversals}):
        reversals = [c for c in figures.reversals if (c.robot, c.joint) == (robot, joint)]
        other = sum(change.before * change.after < 0 for change in reversals)
        within = sum(change.ends_s - change.begins_s for change in reversals)
        name = f"{robot} joint {joint}" if several else f"joint {joint}"
        rows.append((name, str(len(reversals)), str(other), f"{within:.2f}"))
    deviations_with_wrong_backlash = [
        reversals.deviation_m
        for reversals in figures.robustness
        if reversals.name.startswith("backlash")
    ]
    most = max(
        (UM * reversals.maximum for reversals in deviations_with_wrong_backlash), default=0.0
    )
    much = (
        f", of up to {most:.2f} um if all are wrong by 20 %"
        if deviations_with_wrong_backlash
        else ""
    )
    text = (
        f"Gears enter their backlash {len(figures.reversals)} times. The command compensates this with"
        f" the backlash of the model; an error of the backlash causes a deviation there{much}."
    )
    columns = ("gear", "times in backlash", "to the other flank", "in backlash [s]")
    return [Section("Passages through the backlash", (text, Table(columns, rows)))]


def gear_loads(gears: Sequence[GearResult]) -> list[Section]:
    """Return whether the path rests on the gears' backlash."""
    if not gears:
        return []
    several = len({gear.robot for gear in gears}) > 1
    slips = any(gear.hysteresis_30_percent_m is not None for gear in gears)
    rows = [
        (
            f"{gear.robot} joint {gear.joint}" if several else f"joint {gear.joint}",
            str(gear.backlash_reversals),
            f"{gear.in_backlash_s:.2f}",
            f"{UM * gear.backlash_20_percent_m:.0f}",
            *([f"{UM * (gear.hysteresis_30_percent_m or 0.0):.0f}"] if slips else []),
            f"{max(gear.margin_Nm, 0.0):.0f}",
            f"{-gear.margin_Nm:.0f}" if gear.margin_Nm < 0.0 else "-",
            "-" if gear.base_tilt_rad is None else f"{degrees(gear.base_tilt_rad):.1f}",
        )
        for gear in gears
    ]
    columns = (
        "gear",
        "backlash reversals",
        "in backlash [s]",
        "backlash 20 % off, at rest [um]",
        *(["hysteresis 30 % off, at rest [um]"] if slips else []),
        "margin to reversal [N m]",
        "preload that avoids reversals [N m]",
        "or a base tilted by [deg]",
    )
    return [Section("Torques and reversals of the gears", (_LOADS, Table(columns, rows)))]


def motors(figures: RunResult) -> list[Section]:
    """Return what the command asks of the motors, beside their limits."""
    driven = [drive for drive in figures.command.drives if drive.motor_torque_Nm is not None]
    if not driven:
        return []
    several = len(figures.robots) > 1
    rows = [
        (
            f"{drive.robot} joint {drive.joint}" if several else f"joint {drive.joint}",
            f"{drive.motor_torque_Nm:.4g}",
            *motor_limit(drive.motor_torque_Nm or 0.0, drive.motor_torque_limit_Nm),
            f"{drive.motor_torque_time_s:.3f}",
            str(drive.motor_reversals),
            f"{100.0 * (drive.motor_presliding_share or 0.0):.1f}",
        )
        for drive in driven
    ]
    columns = (
        *("motor", "torque [N m]", "limit", "used", "at t = [s]", "reversals"),
        "friction sticks [% of the time]",
    )
    return [Section("Demands on the motors", (_MOTORS, Table(columns, rows)))]


def motor_limit(demand: float, limit: float | None) -> tuple[str, str]:
    """Return a motor's limit of torque and what is used of it, in words; torques in N m."""
    return ("none", "-") if limit is None else (f"{limit:.4g}", f"{100.0 * demand / limit:.0f} %")


_MOTORS = Note(
    "Torque of rotor, friction and gear at the gear's output, without the motor's limit. Friction sticks"
    " at rest and after a reversal, until the motor has turned by the presliding angle."
)
_LOADS = Note(
    "From the torque of the links along the path. Where a gear reverses, or is unloaded at rest, an"
    " error of the backlash causes the deviation in the table at rest, and several times as much in"
    " motion, as the link moves on freely; the simulations of robots with another backlash show it"
    " for all gears together. If the torque of a gear keeps its sign, an error of its backlash"
    " causes only a constant deviation."
)


def _of_deviations(rows: Iterable[tuple[str, Deviation]]) -> Table:
    return Table(
        (
            "deviation [um]",
            "max",
            "rms",
            "max across travel",
            "at t = [s]",
            "max less a constant",
            "rms less a constant",
        ),
        [
            (
                name,
                *(
                    f"{UM * length:.2f}"
                    for length in (deviation.maximum, deviation.rms, deviation.normal_maximum)
                ),
                f"{deviation.time_of_maximum:.3f}",
                *(_less_constant(deviation) or ("-", "-"))[:2],
            )
            for name, deviation in rows
        ],
    )
