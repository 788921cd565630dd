"""What a study shows on the terminal."""

from __future__ import annotations

from pathlib import Path
from typing import Any

from rich.console import Console

from coupling.study.folder import REPORT
from coupling.study.stored_study import StoredStudy


def print_findings(console: Console, study: StoredStudy, folder: Path) -> None:
    """Say in plain words what a study found and where it is."""
    figures = study.figures
    command, coverage = figures["command"], figures["coverage"]
    lines = []
    if not command["converged"]:
        lines.append(f"The command is NOT CONVERGED: {command['reason']}.")
    largest, rms = (figures["quantiles_m"][name] for name in ("maximum", "rms"))
    less = figures["quantiles_m"]["maximum_less_constant"]
    lines += [
        f"On the dynamic model the command leaves max {_um(command['deviation_m']['maximum'])}, rms"
        f" {_um(command['deviation_m']['rms'])}.",
        f"{100 * coverage:g} % of further robots stay below {_um(largest[f'{coverage:g}'])} along the"
        f" whole path, with an rms below {_um(rms[f'{coverage:g}'])}; half of them below"
        f" {_um(largest['0.5'])}, rms {_um(rms['0.5'])} ({study.figures['samples']} sampled,"
        f" {_wrench(figures)}).",
        f"Less a constant, as where the part is touched off, {100 * coverage:g} % stay below"
        f" {_um(less[f'{coverage:g}'])}, half of them below {_um(less['0.5'])}.",
    ]
    lines += _of_parameters(figures)
    if figures["failed"]:
        number, reason = next(iter(figures["failed"].items()))
        lines.append(
            f"Warning: {len(figures['failed'])} robots could not be simulated, such as number"
            f" {number}: {reason}"
        )
    if figures["not_coupled"]:
        lines.append(
            f"Warning: {len(figures['not_coupled'])} robots did not converge with their process."
        )
    lines.append(f"Study: {folder}  (report: {folder / REPORT})")
    style = None if command["converged"] else "yellow"
    console.print("\n".join(lines), style=style)


def _of_parameters(figures: dict[str, Any]) -> list[str]:
    """Return which parameter matters, the most important one first."""
    entries = figures["parameters"]
    if entries[0]["influence"]["maximum"] is None:
        return ["Too few samples to tell which parameter matters."]
    ordered = sorted(entries, key=lambda entry: -entry["influence"]["maximum"]["share"])
    lines = ["Share of each parameter in the variance of the largest deviation:"]
    lines += [
        f"  {entry['name'] + ':':<24}{100 * entry['influence']['maximum']['share']:>4.0f} %"
        f"  ({entry['distribution']})"
        for entry in ordered[:10]
    ]
    silent = figures["silent"]
    return lines + ([f"Without effect here, left out: {', '.join(silent)}."] if silent else [])


def _wrench(figures: dict[str, Any]) -> str:
    if figures["wrench"] == "coupled":
        return f"each coupled with its process, {figures['process_evaluations']} evaluations"
    return "under the wrench on the model"


def _um(length: float) -> str:
    return f"{1e6 * length:.2f} um"
