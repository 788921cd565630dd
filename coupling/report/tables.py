"""Tables of a run's figures."""

from __future__ import annotations

import html
from collections.abc import Iterable, Sequence
from math import degrees, isnan
from typing import Any

from coupling.path.deviation import Deviation
from coupling.report.shares import BEHIND, DeviationShare, shares_of
from coupling.results.run_result import GearResult, ReversalResult, RunResult
from coupling.run.stored_run import StoredRobot
from coupling.solve.correction import HOW

_UM = 1e6
_MODES = {"dynamic": "moving robot", "quasistatic": "quasi-static robot"}


def mode_names(mode: str) -> tuple[str, str]:
    """Return what to call the robot in a run's mode and in the other one."""
    own = _MODES[mode]
    return own, next(name for name in _MODES.values() if name != own)


def table(
    header: Sequence[str],
    rows: Iterable[Sequence[str]],
    kind: str = "",
    groups: Sequence[tuple[str, int]] = (),
) -> str:
    """Return a table of cells of HTML.

    Args:
        header: Cells of its first row.
        rows: Cells of the others.
        kind: "words" for a table of text, whose columns begin at the left; "dense" for one that is
            to be seen whole on a narrow screen.
        groups: What stands above the header, each over so many columns.
    """
    above = [
        f'<th scope="colgroup" colspan="{columns}">{cell}</th>' if cell else "<td></td>"
        for cell, columns in groups
    ]
    lines = [above] if groups else []
    lines += [[f'<th scope="col">{cell}</th>' for cell in header]]
    lines += [[f"<td>{cell}</td>" for cell in row] for row in rows]
    content = "".join(f"<tr>{chr(10).join(line)}</tr>" for line in lines)
    marked = f' class="{kind}"' if kind else ""
    return f'<div class="scroll" tabindex="0"><table{marked}>{content}</table></div>'


def deviations(run: StoredRobot) -> str:
    """Return how far the tool is off, before and after, and why."""
    figures = run.figures
    shares, (own, other) = figures.shares_m, mode_names(figures.mode)
    parts = [shares_of(run, stage) for stage in run.actual]
    whole = figures.deviations
    gravity, process = (
        [shares.gravity, shares.gravity_after],
        [shares.process, shares.process_after],
    )
    rows: list[tuple[str, Sequence[Any]]] = [
        (f"{own}, {HOW[figures.before]}" if len(parts) == 1 else own, whole),
        ("&nbsp; less a constant", [_less_constant(own) for own in whole]),
        ("&nbsp; gravity alone", gravity[: len(parts)]),
        (
            "&nbsp; &nbsp; less a constant",
            [_less_constant(own) for own in gravity[: len(parts)]],
        ),
        ("&nbsp; process (loaded minus unloaded)", process[: len(parts)]),
        ("&nbsp; motion (moving minus quasi-static)", [part.motion for part in parts]),
        (
            f"&nbsp; while gears are in their backlash, and {BEHIND:g} s behind",
            [part.flanks for part in parts],
        ),
        ("&nbsp; at all other times", [part.elsewhere for part in parts]),
        (f"{other} under the same command and wrench", [part.other for part in parts]),
    ]
    stage_columns = ("max", "rms", "at t = [s]")
    header = ["deviation [um]", *stage_columns * len(parts)]
    groups = [("", 1), *((stage, len(stage_columns)) for stage in run.actual)]
    told = [(name, [_figures_of(cell) for cell in cells]) for name, cells in rows]
    how = (
        f"<p>Before compensation the robot is {HOW[figures.before]}; after it, with the process on"
        " the path that the tool really takes. Its gravity alone is where the corrected command leads"
        " the tool without the process, which then moves it by the process's share. Shares do not add"
        " up: they point to different sides. Less a constant is what is left where the part or the"
        " path is shifted by the mean deviation.</p>"
        if figures.kind == "compensate"
        else ""
    )
    return (
        table(
            header,
            [(name, *sum(cells, ())) for name, cells in told if any(map(_is_told, cells))],
            "dense",
            groups,
        )
        + how
        + _of_tooth_passing(figures)
    )


def _less_constant(found: Deviation | None) -> tuple[str, ...] | None:
    """Return max and rms of a deviation less a constant [um]; None in a run of an earlier version."""
    if found is None or isnan(found.maximum_less_constant):
        return None
    return f"{_UM * found.maximum_less_constant:.2f}", f"{_UM * found.rms_less_constant:.2f}", ""


def _figures_of(found: Deviation | DeviationShare | tuple[str, ...] | None) -> tuple[str, ...]:
    """Return largest, rms and instant of a deviation [um], [s]."""
    if found is None:
        return ("", "", "")
    if isinstance(found, tuple):
        return found
    time = found.time if isinstance(found, DeviationShare) else found.time_of_maximum
    return (f"{_UM * found.maximum:.2f}", f"{_UM * found.rms:.2f}", f"{time:.3f}")


def _is_told(cells: tuple[str, ...]) -> bool:
    return any(cells)


def _of_tooth_passing(figures: RunResult) -> str:
    """Return what a periodic process leaves, in parts."""
    tooth_passing = figures.tooth_passing
    if tooth_passing is None:
        return ""
    walls = ", ".join(
        f"{axis} {1e6 * low:.2f} to {1e6 * high:.2f}"
        for axis, (low, high) in tooth_passing.envelope_m.items()
    )
    return (
        f"<p>A tooth passes every {1e3 * tooth_passing.period_s:.3g} ms. Of the last deviation the slow"
        f" part, its mean over a tooth passing, is at most {1e6 * tooth_passing.slow_m:.2f} um, the"
        " ripple around it"
        f" {1e6 * tooth_passing.ripple_m:.2f} um; a surface cut at the extremes of every tooth passing"
        " lies off by"
        f" {walls} um, base axes.</p>"
    )


def robustness(figures: RunResult) -> str:
    """Return what the command leaves on robots that differ from the model, with a heading."""
    if not figures.robustness:
        return ""
    rows = [(html.escape(row.name), row.deviation_m) for row in figures.robustness]
    return (
        "<h2>On robots that differ from the model</h2><p>The command assumes the robot's parameters."
        " What it leaves, as written and under the same wrench, on dynamic robots whose gears and tilts"
        f" all differ:</p>{_of_deviations(rows)}"
    )


def plant(figures: RunResult) -> str:
    """Return what the command leaves on the plant beside the model, with a heading."""
    found = figures.plant
    if found is None:
        return ""
    if found.coupling is None:
        how = "Its wrench is that on the model, times the factor of the force."
    else:
        how = (
            "The process was evaluated on the path that the plant takes:"
            f" {html.escape(found.coupling.reason)}."
        )
    if found.remark:
        how += f" <b>Warning</b>: {html.escape(found.remark)}."
    model, mode = figures.shares_m.dynamic_after, "dynamic"
    if model is None:  # a coupling corrects nothing
        model, mode = figures.deviation_before_m, figures.mode
    rows = [(f"{mode} model", model), ("dynamic plant", found.deviation_m)]
    differences = html.escape(", ".join(found.differences) or "nothing")
    return (
        f"<h2>On the plant</h2><p>The same command on a robot that is not the model: {differences}."
        f" {how}</p>{_of_deviations(rows)}"
    )


def gears(changes: Sequence[ReversalResult]) -> str:
    """Return how often which gear passes through its backlash.

    Args:
        changes: `backlash_reversals` of result.json.
    """
    rows = []
    for joint in sorted({change.joint for change in changes}):
        own = [change for change in changes if change.joint == joint]
        other = sum(change.before * change.after < 0 for change in own)
        within = sum(change.ends_s - change.begins_s for change in own)
        rows.append((f"joint {joint}", str(len(own)), str(other), f"{within:.2f}"))
    return table(("gear", "times in its backlash", "to the other flank", "time in it [s]"), rows)


def gear_loads(gears: Sequence[GearResult]) -> str:
    """Return whether the path rests on the gears' backlash, with a heading."""
    if not gears:
        return ""
    rows = [
        (
            f"joint {gear.joint}",
            str(gear.backlash_reversals),
            f"{gear.in_backlash_s:.2f}",
            f"{_UM * gear.backlash_20_percent_m:.0f}",
            f"{max(gear.margin_Nm, 0.0):.0f}",
            f"{-gear.margin_Nm:.0f}" if gear.margin_Nm < 0.0 else "-",
            "-" if gear.base_tilt_rad is None else f"{degrees(gear.base_tilt_rad):.1f}",
        )
        for gear in gears
    ]
    header = (
        "gear",
        "backlash reversals",
        "in backlash [s]",
        "backlash 20 % off, at rest [um]",
        "clear of zero by [N m]",
        "preload that avoids reversals [N m]",
        "or a base tilted by [deg]",
    )
    return (
        "<h2>What the gears go through</h2><p>From the torque that the links need along the path. Where"
        " a gear reverses, or is in its backlash for want of a torque at rest, a wrong backlash"
        " shows: at rest by what it is off, in motion by several times as much, as the link drifts with"
        " what it was given; the replays on robots with another backlash tell that for all gears"
        " together. A gear that stays clear of zero does not ask for its backlash.</p>"
        f"{table(header, rows)}"
    )


def _of_deviations(rows: Iterable[tuple[str, Deviation]]) -> str:
    return table(
        (
            "deviation [um]",
            "max",
            "rms",
            "max across travel",
            "at t = [s]",
            "max less a constant",
            "rms less a constant",
        ),
        (
            (
                name,
                *(f"{_UM * length:.2f}" for length in (own.maximum, own.rms, own.normal_maximum)),
                f"{own.time_of_maximum:.3f}",
                *(_less_constant(own) or ("-", "-"))[:2],
            )
            for name, own in rows
        ),
    )
