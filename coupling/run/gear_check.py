"""Check of the gears along the path: torques, reversals, rated loads."""

from __future__ import annotations

from collections.abc import Sequence
from math import degrees

from coupling.path.length_text import in_words
from coupling.results.gear_result import GearDiagnosis
from coupling.results.limit_warning import LimitWarning
from coupling.results.replay import worst_backlash
from coupling.results.run_result import RunResult
from coupling.results.section import UM, Note, Section, Table
from coupling.run.check import Check, CheckedCommand
from coupling.run.gear_loads import diagnose_robots, load_warnings


def _compute(command: CheckedCommand) -> tuple[tuple[GearDiagnosis, ...], ...]:
    case = command.case
    rigid = command.cell.undeflected(case.desired)
    return diagnose_robots(case.robots, case.desired, command.loads, rigid)


def _warnings(command: CheckedCommand) -> tuple[LimitWarning, ...]:
    return load_warnings(command.case.robots, command.loads, command.finding_of(GEAR_LOADS))


def _sections(figures: RunResult) -> list[Section]:
    return [*_passages(figures), *gear_sections(figures.gears)]


def _passages(figures: RunResult) -> list[Section]:
    """Return how often which gear passes through its backlash, and what a wrong one leaves."""
    if not figures.reversals:
        return []
    several, rows = len(figures.robots) > 1, []
    for robot, joint in sorted({(change.robot, change.joint) for change in figures.reversals}):
        reversals = [c for c in figures.reversals if (c.robot, c.joint) == (robot, joint)]
        other = sum(change.before * change.after < 0 for change in reversals)
        within = sum(change.ends - change.begins for change in reversals)
        name = f"{robot} joint {joint}" if several else f"joint {joint}"
        rows.append((name, str(len(reversals)), str(other), f"{within:.2f}"))
    wrong, much = worst_backlash(figures.robustness), ""
    if wrong is not None:
        much = f", of up to {in_words(wrong.deviation.maximum)} if all are wrong by 20 %"
    text = (
        f"Gears enter their backlash {len(figures.reversals)} times. The command compensates this with"
        f" the backlash of the model; an error of the backlash causes a deviation there{much}."
    )
    columns = ("gear", "times in backlash", "to the other flank", "in backlash [s]")
    return [Section("Passages through the backlash", (text, Table(columns, rows)))]


def gear_sections(gears: Sequence[GearDiagnosis]) -> list[Section]:
    """Return whether the path rests on the gears' backlash."""
    if not gears:
        return []
    several = len({gear.robot for gear in gears}) > 1
    slips = any(gear.hysteresis_error is not None for gear in gears)
    rows = [
        (
            f"{gear.robot} joint {gear.joint}" if several else f"joint {gear.joint}",
            str(gear.reversals),
            f"{gear.in_backlash:.2f}",
            f"{UM * gear.backlash_error:.0f}",
            *([f"{UM * (gear.hysteresis_error or 0.0):.0f}"] if slips else []),
            f"{max(gear.margin, 0.0):.0f}",
            f"{-gear.margin:.0f}" if gear.margin < 0.0 else "-",
            "-" if gear.base_tilt is None else f"{degrees(gear.base_tilt):.1f}",
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


_LOADS = Note(
    "From the torque of the links along the path. Where a gear reverses, or is unloaded at rest, an"
    " error of the backlash causes the deviation in the table at rest, and several times as much in"
    " motion, as the link moves on freely; the simulations of robots with another backlash show it"
    " for all gears together. If the torque of a gear keeps its sign, an error of its backlash"
    " causes only a constant deviation."
)

GEAR_LOADS = Check[tuple[tuple[GearDiagnosis, ...], ...]](
    "gears", _compute, (), warnings=_warnings, sections=_sections
)
