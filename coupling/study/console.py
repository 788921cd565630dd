"""What a study shows on the terminal."""

from __future__ import annotations

from pathlib import Path

from rich.console import Console

from coupling.results.study_result import StudyResult
from coupling.study.folder import REPORT
from coupling.study.stored_study import StoredStudy


def print_findings(console: Console, study: StoredStudy, folder: Path) -> None:
    """Say in plain words what a study found and where it is."""
    figures = study.figures
    command, coverage = figures.command, figures.coverage
    lines = []
    if not command.converged:
        lines.append(f"The command is NOT CONVERGED: {command.reason}.")
    (largest, most), (rms, most_rms), (less, most_less) = (
        (figures.quantile(name, 0.5), figures.quantile(name, coverage))
        for name in ("maximum", "rms", "maximum_less_constant")
    )
    lines += [
        f"On the dynamic model the command leaves max {_um(command.deviation_m.maximum)}, rms"
        f" {_um(command.deviation_m.rms)}.",
        f"{100 * coverage:g} % of further robots stay below {_um(most)} along the"
        f" whole path, with an rms below {_um(most_rms)}; half of them below"
        f" {_um(largest)}, rms {_um(rms)} ({figures.samples} sampled,"
        f" {_wrench(figures)}).",
        f"Less a constant, as where the part is touched off, {100 * coverage:g} % stay below"
        f" {_um(most_less)}, half of them below {_um(less)}.",
    ]
    lines += _of_parameters(figures)
    if figures.failed:
        number, reason = next(iter(figures.failed.items()))
        lines.append(
            f"Warning: {len(figures.failed)} robots could not be simulated, such as number"
            f" {number}: {reason}"
        )
    if figures.not_coupled:
        lines.append(
            f"Warning: {len(figures.not_coupled)} robots did not converge with their process."
        )
    lines.append(f"Study: {folder}  (report: {folder / REPORT})")
    console.print("\n".join(lines), style=None if command.converged else "yellow")


def _of_parameters(figures: StudyResult) -> list[str]:
    """Return which parameter matters, the most important one first."""
    if not figures.ordered:
        return ["Too few samples to tell which parameter matters."]
    lines = ["Share of each parameter in the variance of the largest deviation:"]
    lines += [
        f"  {entry.name + ':':<24}{100 * shares['maximum'].share:>4.0f} %  ({entry.distribution})"
        for entry, shares in figures.ordered[:10]
    ]
    silent = figures.silent
    return lines + ([f"Without effect here, left out: {', '.join(silent)}."] if silent else [])


def _wrench(figures: StudyResult) -> str:
    if figures.wrench == "coupled":
        return f"each coupled with its process, {figures.process_evaluations} evaluations"
    return "under the wrench on the model"


def _um(length: float) -> str:
    return f"{1e6 * length:.2f} um"
