"""Sections of a run's figures."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

from coupling.path.deviation import Deviation
from coupling.path.length_text import in_unit, in_words, length_unit
from coupling.report.shares import BEHIND, DeviationShare, DeviationShares
from coupling.results.replay import less_constant
from coupling.results.run_result import RunResult, shown_name
from coupling.results.section import Note, Section, Table
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
    _, unit = length_unit(*(deviation.maximum for deviation in whole))
    gravity = [shares.gravity, shares.gravity_after][:stages]
    process = [shares.process, shares.process_after][:stages]
    rows: list[tuple[str, Sequence[Any]]] = [
        (f"{mode}, {HOW[figures.before]}" if stages == 1 else mode, whole),
        (f"{_IN}less a constant", [less_constant(deviation, unit) for deviation in whole]),
        (f"{_IN}gravity alone", gravity),
        (f"{_IN}{_IN}less a constant", [less_constant(deviation, unit) for deviation in gravity]),
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
    filled = [(name, [_figures_of(cell, unit) for cell in cells]) for name, cells in rows]
    deviation = Table(
        (f"deviation [{unit}]", *columns * stages),
        [(name, *sum(cells, ())) for name, cells in filled if any(map(any, cells))],
        "dense",
        [("", 1), *((shown_name(stage), len(columns)) for stage in figures.stages)],
    )
    if figures.kind == "couple":
        return Section("", (deviation, *_of_tooth_passing(figures)))
    how = (
        f"Before compensation: {HOW[figures.before]}. After, if the file is right: with the process on"
        " the tool's actual path."
    )
    return Section("", (how, deviation, _SHARES, *_of_tooth_passing(figures)))


_SHARES = Note(
    "Gravity alone: deviation under the same command without the process, whose force a corrected one"
    " expects. The shares do not add up, as their directions differ. Less a constant: after subtraction"
    " of the mean deviation, which a shift of the part can remove."
)


def _figures_of(
    deviation: Deviation | DeviationShare | tuple[str, ...] | None, unit: str
) -> tuple[str, ...]:
    """Return largest, rms and instant of a deviation, in a unit of lengths and [s]."""
    if deviation is None:
        return ("", "", "")
    if isinstance(deviation, tuple):
        return deviation
    time = deviation.time if isinstance(deviation, DeviationShare) else deviation.time_of_maximum
    return (in_unit(deviation.maximum, unit), in_unit(deviation.rms, unit), f"{time:.3f}")


def _of_tooth_passing(figures: RunResult) -> list[str]:
    """Return what a periodic process leaves, in parts, and the mean force of a cut."""
    tooth_passing, mean = figures.tooth_passing, figures.mean_force_across
    forces = [] if mean is None else [mean.sentence]
    if tooth_passing is None:
        return forces
    envelope = tooth_passing.envelope_m
    _, unit = length_unit(*(abs(end) for ends in envelope.values() for end in ends))
    walls = ", ".join(
        f"{axis} {in_unit(low, unit)} to {in_unit(high, unit)}"
        for axis, (low, high) in envelope.items()
    )
    return [
        f"Tooth passing: {1e3 * tooth_passing.period_s:.3g} ms. The mean of the last deviation over a"
        f" tooth passing is at most {in_words(tooth_passing.slow_m)}, the ripple about it"
        f" {in_words(tooth_passing.ripple_m)}. A surface cut at the extremes of each tooth passing"
        f" deviates by {walls} {unit}, base axes.",
        *forces,
    ]
