"""What a run shows on the terminal: progress, a row per evaluation, a summary in plain words."""

from __future__ import annotations

import logging
from collections.abc import Callable
from pathlib import Path
from types import TracebackType

from rich.console import Console
from rich.markup import escape
from rich.progress import BarColumn, Progress, TextColumn, TimeRemainingColumn

from coupling.case import Case
from coupling.path.deviation import Deviation
from coupling.path.tool_gap import PinchGap
from coupling.run.folder import runs_of_robots
from coupling.run.study import Run, Watch
from coupling.solve.fixed_point import Evaluation
from coupling.solve.mirror import Pass

_HEADER = (
    f"{'eval':>5} {'path change max':>16} {'rms':>10} {'force change':>13} {'deviation':>11}\n"
    f"{'':>5} {'[um]':>16} {'[um]':>10} {'[%]':>13} {'[um]':>11}"
)


# What a process tells while it works, line by line.
_PROCESS_LOG = logging.getLogger("coupling.process")


class _Lines(logging.Handler):
    """Hands the messages of a log to a function."""

    def __init__(self, show: Callable[[str], None]) -> None:
        super().__init__()
        self._show = show

    def emit(self, record: logging.LogRecord) -> None:
        self._show(record.getMessage())


class RunView:
    """Shows a run while it goes on; a context manager that clears its progress bar.

    Args:
        console: Where to.
    """

    def __init__(self, console: Console) -> None:
        self._console = console
        self._progress = Progress(
            TextColumn("{task.description}"),
            BarColumn(),
            TextColumn("{task.fields[count]}"),
            TimeRemainingColumn(),
            console=console,
            transient=True,
        )
        self._task = self._progress.add_task("", visible=False, count="")
        self._lines = _Lines(self._process_says)
        self._count = 0

    def __enter__(self) -> RunView:
        self._console.print(_HEADER, style="bold", highlight=False, markup=False)
        self._progress.start()
        _PROCESS_LOG.addHandler(self._lines)
        _PROCESS_LOG.setLevel(logging.INFO)
        return self

    def __exit__(
        self,
        kind: type[BaseException] | None,
        error: BaseException | None,
        trace: TracebackType | None,
    ) -> None:
        _PROCESS_LOG.removeHandler(self._lines)
        self._progress.stop()

    def watch(self) -> Watch:
        """Return the callbacks for a run."""
        return Watch(self._simulating, self._evaluated, self._passed)

    def _simulating(self, what: str, done: int, total: int) -> None:
        self._progress.update(
            self._task,
            description=what,
            completed=done,
            total=total,
            count=f"{done}/{total} steps",
            visible=done < total,
        )

    def _process_says(self, line: str) -> None:
        self._progress.update(
            self._task, description=escape(f"process: {line}"), total=None, count="", visible=True
        )

    def _evaluated(self, evaluation: Evaluation, deviation: float) -> None:
        self._count += 1
        first = evaluation.number == 1
        force = "" if first else f"{100.0 * evaluation.force_change:.4f}"
        self._console.print(
            f"{self._count:>5} {1e6 * evaluation.path_change:>16.4f}"
            f" {1e6 * evaluation.path_change_rms:>10.4f} {force:>13} {1e6 * deviation:>11.3f}",
            highlight=False,
        )

    def _passed(self, finished: Pass) -> None:
        text = f"      pass {finished.number}: deviation max {_um(finished.deviation.maximum)}"
        text += f", rms {_um(finished.deviation.rms)}"
        if finished.number > 0:
            text += (
                f"; largest step of the correction {_um(finished.largest_correction_step)} at t ="
                f" {finished.step_time:.2f} s"
            )
        if finished.limited_samples:
            text += f"; rate limited at {finished.limited_samples} samples"
        self._console.print(text, style="cyan", highlight=False, markup=False, soft_wrap=True)


def print_summary(console: Console, case: Case, run: Run, folder: Path) -> None:
    """Say in plain words what a run found and where it is."""
    mode, compensated = case.settings.mode, run.kind == "compensate"
    lines = [
        f"{'Converged' if run.converged else 'NOT CONVERGED'}: {run.reason}.",
        f"{'Before compensation the' if compensated else 'The'} {mode} robot deviates by"
        f" {_figures(run.before)}",
        f"  gravity alone (no process):          {_figures(run.shares.gravity)}",
        f"  process alone (loaded - unloaded):   {_figures(run.shares.process)}",
    ]
    if compensated:
        lines += [
            f"After compensation, process evaluated on the path really taken ({mode} robot):",
            f"                                       {_figures(run.after)}",
        ]
    if run.shares.dynamic is not None:
        lines += [
            "The corrected command simulated in dynamic mode, under the same wrench:",
            f"                                       {_figures(run.shares.dynamic)}",
        ]
    if run.gap is not None:
        lines += _of_cell(run.gap, runs_of_robots(case, run), compensated)
    lines += [
        f"Peak force {run.wrench.peak_force:.1f} N; {run.process_evaluations} evaluations of the"
        f" process; {sum(run.durations.values()):.1f} s.",
    ]
    lines += [f"Warning: {warning}" for warning in run.rate_warnings]
    lines.append(f"Result: {folder}  (report: {folder / 'report.html'})")
    style = None if run.converged else "yellow"
    console.print("\n".join(lines), style=style, highlight=False, markup=False, soft_wrap=True)


def _of_cell(gap: PinchGap, robots: dict[str, Run], compensated: bool) -> list[str]:
    """Return what there is to say of the gap between the tools and of each robot."""
    figures = gap.as_dict()

    def opening(stage: str) -> str:
        low, high = figures[f"narrowest_{stage}"], figures[f"widest_{stage}"]
        return f"{1e3 * low:.3f} to {1e3 * high:.3f} mm"

    text = f"Gap between the tools, commanded {1e3 * gap.commanded:.3f} mm: {opening('before')}"
    if not compensated:
        return [f"{text}."] + [
            f"  {name} robot: {_figures(own.before)}" for name, own in robots.items()
        ]
    lines = [f"{text} before, {opening('after')} after."]
    for name, own in robots.items():
        lines.append(f"  {name} robot before: {_figures(own.before)}")
        lines.append(f"  {name} robot after:  {_figures(own.after)}")
    return lines


def _um(length: float) -> str:
    return f"{1e6 * length:.2f} um"


def _figures(deviation: Deviation) -> str:
    return (
        f"max {_um(deviation.maximum)} at t = {deviation.time_of_maximum:.2f} s,"
        f" rms {_um(deviation.rms)}"
    )
