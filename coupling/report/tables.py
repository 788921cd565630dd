"""Tables of a run's figures."""

from __future__ import annotations

import html
from collections.abc import Iterable, Sequence
from math import degrees
from typing import Any

from coupling.run.stored_run import stages
from coupling.solve.correction import HOW

_UM = 1e6


def table(header: Sequence[str], rows: Iterable[Sequence[str]]) -> str:
    """Return a table of cells of HTML."""
    lines = [[f"<th>{cell}</th>" for cell in header]]
    lines += [[f"<td>{cell}</td>" for cell in row] for row in rows]
    return f"<table>{''.join(f'<tr>{chr(10).join(line)}</tr>' for line in lines)}</table>"


def deviations(figures: dict[str, Any]) -> str:
    """Return how far the tool is off, before and after, and why."""
    shares, mode = figures["shares_m"], figures["mode"]
    rows = [
        (
            f"{stages(figures)[0]}, {mode} robot {HOW[figures['before']]}",
            figures["deviation_before_m"],
        ),
        ("&nbsp; of this: gravity alone", shares["gravity"]),
        ("&nbsp; of this: process (loaded minus unloaded)", shares["process"]),
    ]
    if figures["kind"] == "compensate":
        what = f"after compensation, {mode} robot, process on the path that it really takes"
        rows.append((what, figures["deviation_after_m"]))
        if mode != "dynamic":
            rows.append(("the same command and wrench, dynamic robot", shares["dynamic_after"]))
    return (
        _of_deviations(rows)
        + (
            f"<p>{figures['process_evaluations']} evaluations of the process; peak force"
            f" {figures['peak_force_N']:.1f} N.</p>"
        )
        + _of_beat(figures)
    )


def _of_beat(figures: dict[str, Any]) -> str:
    """Return what a process that beats leaves, in parts."""
    beat = figures["beat"]
    if beat is None:
        return ""
    walls = ", ".join(
        f"{axis} {1e6 * low:.2f} to {1e6 * high:.2f}"
        for axis, (low, high) in beat["envelope_m"].items()
    )
    return (
        f"<p>The process beats every {1e3 * beat['period_s']:.3g} ms. Of the last deviation the slow"
        f" part, its mean over a beat, is at most {1e6 * beat['slow_m']:.2f} um, the ripple around it"
        f" {1e6 * beat['ripple_m']:.2f} um; a surface cut at the extremes of every beat lies off by"
        f" {walls} um, base axes.</p>"
    )


def robustness(figures: dict[str, Any]) -> str:
    """Return what the command leaves on robots that differ from the model, with a heading."""
    if not figures["robustness"]:
        return ""
    rows = [(html.escape(row["name"]), row["deviation_m"]) for row in figures["robustness"]]
    return (
        "<h2>On robots that differ from the model</h2><p>The command assumes the robot's parameters."
        " What it leaves, as written and under the same wrench, on dynamic robots whose gears and tilts"
        f" all differ:</p>{_of_deviations(rows)}"
    )


def plant(figures: dict[str, Any]) -> str:
    """Return what the command leaves on the plant beside the model, with a heading."""
    found = figures["plant"]
    if found is None:
        return ""
    if found["coupling"] is None:
        how = "Its wrench is that on the model, times the factor of the force."
    else:
        how = (
            "The process was evaluated on the path that the plant takes:"
            f" {html.escape(found['coupling']['reason'])}."
        )
    if found["remark"]:
        how += f" <b>Warning</b>: {html.escape(found['remark'])}."
    model, mode = figures["shares_m"]["dynamic_after"], "dynamic"
    if model is None:  # a coupling corrects nothing
        model, mode = figures["deviation_before_m"], figures["mode"]
    rows = [(f"{mode} model", model), ("dynamic plant", found["deviation_m"])]
    differences = html.escape(", ".join(found["differences"]) or "nothing")
    return (
        f"<h2>On the plant</h2><p>The same command on a robot that is not the model: {differences}."
        f" {how}</p>{_of_deviations(rows)}"
    )


def drives(figures: dict[str, Any]) -> str:
    """Return what the command asks of the drives, with a heading."""

    def limit(value: float | None) -> str:
        return "none" if value is None else f"{value:.3g}"

    rows = [
        (
            f"joint {drive['joint']}",
            f"{drive['rate_rad_s']:.3g}",
            limit(drive["rate_limit_rad_s"]),
            f"{drive['acceleration_rad_s2']:.3g}",
            limit(drive["acceleration_limit_rad_s2"]),
            f"{drive['acceleration_time_s']:.3f}",
        )
        for drive in figures["command"]["drives"]
    ]
    header = (
        "command",
        "rate [rad/s]",
        "limit",
        "acceleration [rad/s&sup2;]",
        "limit",
        "at t = [s]",
    )
    return (
        "<h2>What the command asks of the drives</h2><p>Largest values, between its rows as well.</p>"
        f"{table(header, rows)}"
    )


def gears(changes: list[dict[str, Any]]) -> str:
    """Return how often which gear passes through its play.

    Args:
        changes: `flank_changes` of result.json.
    """
    rows = []
    for joint in sorted({change["joint"] for change in changes}):
        own = [change for change in changes if change["joint"] == joint]
        other = sum(change["before"] * change["after"] < 0 for change in own)
        within = sum(change["ends_s"] - change["begins_s"] for change in own)
        rows.append((f"joint {joint}", str(len(own)), str(other), f"{within:.2f}"))
    return table(("gear", "times in its play", "to the other flank", "time in it [s]"), rows)


def gear_loads(figures: dict[str, Any]) -> str:
    """Return whether the path rests on the gears' backlash, with a heading."""
    gears = figures["gears"]
    if not gears:
        return ""
    rows = [
        (
            f"joint {gear['joint']}",
            str(gear["flank_changes"]),
            f"{gear['floats_s']:.2f}",
            f"{_UM * gear['backlash_20_percent_m']:.0f}",
            f"{max(gear['margin_Nm'], 0.0):.0f}",
            f"{-gear['margin_Nm']:.0f}" if gear["margin_Nm"] < 0.0 else "-",
            "-" if gear["base_tilt_rad"] is None else f"{degrees(gear['base_tilt_rad']):.1f}",
        )
        for gear in gears
    ]
    header = (
        "gear",
        "flank changes",
        "floats [s]",
        "backlash 20 % off [um]",
        "clear of zero by [N m]",
        "kept by a bias of [N m]",
        "or a base tilted by [deg]",
    )
    return (
        "<h2>What the gears go through</h2><p>From the torque that the links need along the path. Where"
        " a gear changes its flank, or floats in its play for want of a torque at rest, the tool is off"
        " by what its backlash is off; a gear that stays clear of zero does not ask for it.</p>"
        f"{table(header, rows)}"
    )


def _of_deviations(rows: Iterable[tuple[str, dict[str, float]]]) -> str:
    return table(
        ("deviation [um]", "max", "rms", "max across travel", "at t = [s]"),
        (
            (
                name,
                *(f"{_UM * own[key]:.2f}" for key in ("maximum", "rms", "normal_maximum")),
                f"{own['time_of_maximum']:.3f}",
            )
            for name, own in rows
        ),
    )
